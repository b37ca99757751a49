# SPDX-License-Identifier: Apache-2.0
# Facewright: multi-resolution 3D morphable face models.
"""Completion of a program's options for bash, zsh and fish, from its --help. Each function gives a whole file."""

ORIGIN = "# Completion of {} (Facewright), written from what it prints for --help."


def takes_files(option):
    """Whether file names are worth offering: for texts that are not one of a few words."""
    return option.kind in ("TEXT", "FILE") and not option.choices


def bash_completion(program):
    function = "_facewright_" + program.name.replace("-", "_")
    flags = " ".join(name for option in program.options for name in option.names)
    cases = ""
    for option in program.options:
        if not option.takes_value or takes_files(option):
            continue
        words = f'COMPREPLY=($(compgen -W "{" ".join(option.choices)}" -- "$cur"))' if option.choices else "COMPREPLY=()"
        cases += f"    {'|'.join(option.names)}) {words}; return ;;\n"
    files = [name for option in program.options if option.takes_value and takes_files(option) for name in option.names]
    if files:
        cases += f"    {'|'.join(files)}) compopt -o default 2>/dev/null; return ;;\n"
    return f"""{ORIGIN.format(program.name)}
{function}() {{
  local cur=${{COMP_WORDS[COMP_CWORD]}} prev=${{COMP_WORDS[COMP_CWORD - 1]}}
  COMPREPLY=()
  if [[ $cur == = ]]; then # bash takes --option=value for three words
    cur=
  elif [[ $prev == = ]]; then
    prev=${{COMP_WORDS[COMP_CWORD - 2]}}
  fi
  case $prev in
{cases}  esac
  if [[ $cur == -* ]]; then
    COMPREPLY=($(compgen -W "{flags}" -- "$cur"))
  else
    compopt -o default 2>/dev/null
  fi
}}
complete -F {function} {program.name}
"""


def zsh_quoted(text):
    for character in "\\[]:":
        text = text.replace(character, "\\" + character)
    return text.replace("'", "'\\''")


def zsh_value(option):
    if not option.takes_value:
        return ""
    if option.choices:
        return f":{option.long_name.lstrip('-')}:({' '.join(option.choices)})"
    action = ("_files -/" if option.check == "DIR" else "_files") if takes_files(option) else " "
    return f":{option.long_name.lstrip('-')}:{action}"


def zsh_completion(program):
    specs = []
    for option in program.options:
        text = f"[{zsh_quoted(option.text)}]{zsh_value(option)}"
        others = " ".join(([] if option.count == "..." else option.names) + option.excludes)
        repeated = "*" if option.count == "..." else ""
        for name in option.names:
            name += "=" if option.takes_value and name.startswith("--") else ""  # --name value and --name=value
            specs.append(f"'({others}){repeated}{name}{text}'" if others else f"'{repeated}{name}{text}'")
    for i, option in enumerate(program.positionals):
        place = "*" if option.count == "..." else str(i + 1)
        specs.append(f"'{place}:{zsh_quoted(option.long_name)}:_files'")
    return f"#compdef {program.name}\n{ORIGIN.format(program.name)}\n_arguments -S \\\n  " + " \\\n  ".join(specs) + "\n"


def fish_quoted(text):
    return "'" + text.replace("\\", "\\\\").replace("'", "\\'") + "'"


def fish_completion(program):
    lines = [ORIGIN.format(program.name)]
    for option in program.options:
        line = f"complete -c {program.name}"
        for name in option.names:
            line += f" -l {name[2:]}" if name.startswith("--") else f" -s {name[1:]}"
        if option.choices:
            line += f" -x -a {fish_quoted(' '.join(option.choices))}"
        elif option.takes_value:
            line += " -r -F" if takes_files(option) else " -x"
        lines.append(f"{line} -d {fish_quoted(option.text)}")
    return "\n".join(lines) + "\n"
