// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
// A headless Chromium for tests of pages; without it, or without playwright-core, the test is skipped (exit code 77).
import { existsSync } from 'node:fs';
import { createRequire } from 'node:module';
import { join, resolve } from 'node:path';

export function skip(why) {
  console.log(`skipped: ${why}`);
  process.exit(77);
}

export async function openBrowser(modules) {
  const executablePath = ['/usr/bin/chromium', '/usr/bin/chromium-browser', '/usr/bin/google-chrome'].find(existsSync);
  if (!executablePath) skip('no Chromium; install the package chromium');
  if (!existsSync(join(modules, 'playwright-core'))) skip(`no playwright-core in ${modules}; run tests/run, which fetches it`);
  const { chromium } = createRequire(join(resolve(modules), 'any.js'))('playwright-core');
  const args = ['--no-sandbox', '--use-angle=swiftshader', '--enable-unsafe-swiftshader', '--ignore-gpu-blocklist'];
  return chromium.launch({ executablePath, args });
}

// Fails with what was expected if it is not so.
export function expect(so, what) {
  if (!so) throw new Error(`expected: ${what}`);
}
