// SPDX-License-Identifier: Apache-2.0
// Facewright: multi-resolution 3D morphable face models.
// The 68 landmarks of ibug in words; left and right are the subject's.

const groups = [
  ['Jaw', 1, 17], ['Right brow', 18, 22], ['Left brow', 23, 27], ['Nose', 28, 36], ['Right eye', 37, 42], ['Left eye', 43, 48],
  ['Outer lips', 49, 60], ['Inner lips', 61, 68],
];

const words = {
  1: 'by the right ear', 9: 'tip of the chin', 17: 'by the left ear',
  18: 'outer end', 20: 'middle', 22: 'inner end', 23: 'inner end', 25: 'middle', 27: 'outer end',
  28: 'root, between the eyes', 31: 'tip', 32: 'edge of the right nostril', 34: 'under the tip, on the midline', 36: 'edge of the left nostril',
  37: 'outer corner', 38: 'upper lid, outer third', 39: 'upper lid, inner third', 40: 'inner corner', 41: 'lower lid, inner third', 42: 'lower lid, outer third',
  43: 'inner corner', 44: 'upper lid, inner third', 45: 'upper lid, outer third', 46: 'outer corner', 47: 'lower lid, outer third', 48: 'lower lid, inner third',
  49: 'right corner of the mouth', 51: 'right peak of the upper lip', 52: 'dip of the upper lip', 53: 'left peak of the upper lip', 55: 'left corner of the mouth',
  58: 'middle of the lower lip\'s edge', 61: 'right inner corner', 63: 'upper lip, middle', 65: 'left inner corner', 67: 'lower lip, middle',
};

export function groupsOfNames() {
  return groups.map(([title, first, last]) => ({ title, names: Array.from({ length: last - first + 1 }, (_, i) => String(first + i)) }));
}

export function inWords(name) {
  const group = groups.find(([, first, last]) => Number(name) >= first && Number(name) <= last);
  if (!group) return '';
  const [title, first, last] = group;
  return words[name] ?? `${Number(name) - first + 1} of ${last - first + 1} ${title === 'Jaw' ? 'from right to left' : ''}`.trim();
}

export function fullName(name) {
  const group = groups.find(([, first, last]) => Number(name) >= first && Number(name) <= last);
  return group ? `${group[0]}: ${inWords(name)}` : '';
}
