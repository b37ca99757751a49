# SPDX-License-Identifier: Apache-2.0
# Facewright: multi-resolution 3D morphable face models.
"""The manual page of a program, from its --help."""


def roff(text):
    text = text.replace("\\", "\\e").replace("-", "\\-")
    return "\\&" + text if text.startswith((".", "'")) else text


def value_name(option):
    return f" \\fI{roff(option.long_name.lstrip('-').upper())}\\fR" if option.takes_value else ""


def described(option):
    text = roff(option.text) + ("" if option.text.endswith(".") else ".")
    if option.choices:
        text += f"\nOne of {roff(', '.join(option.choices))}."
    if option.range:
        text += f"\nFrom {roff(option.range.replace(' .. ', ' to '))}."
    if option.default not in ("", "[]"):
        text += f"\nDefault: {roff(option.default.strip('[]') or option.default)}."
    if option.required and option.names[0].startswith("-"):
        text += "\nRequired."
    return text


def entry(option):
    names = ", ".join(f"\\fB{roff(name)}\\fR" for name in option.names)
    return f".TP\n{names}{value_name(option) if option.names[0].startswith('-') else ''}\n{described(option)}\n"


def manual_page(program, version):
    groups = {}
    for option in program.options:
        groups.setdefault(option.group or "Options", []).append(option)
    synopsis = roff(program.usage.removeprefix(program.name).strip())
    text = f'.TH "{roff(program.name).upper()}" 1 "" "Facewright {version}" "Facewright"\n'
    text += f".SH NAME\n{roff(program.name)} \\- {roff(program.description.split('. ')[0].rstrip('.'))}\n"
    text += f".SH SYNOPSIS\n\\fB{roff(program.name)}\\fR {synopsis}\n.SH DESCRIPTION\n{roff(program.description)}\n"
    if program.positionals:
        text += ".SH ARGUMENTS\n" + "".join(entry(o) for o in program.positionals)
    for group, options in groups.items():
        text += f".SH {roff(group).upper()}\n" + "".join(entry(o) for o in options)
    text += """.SH EXIT STATUS
.TP
0
done
.TP
1
failed; the message names the file, the stage and the cure
.TP
2
wrong usage
.TP
3
finished, but some inputs failed; each is listed with its reason
.SH CONFIGURATION
The keys of a \\fB\\-\\-config\\fR file are the long option names without dashes. Programs that write results save the options
they ran with beside them, as such a file.
"""
    return text + f".SH EXAMPLE\n.nf\n{roff(program.example)}\n.fi\n"
