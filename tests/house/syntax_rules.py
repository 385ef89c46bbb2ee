#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The texts of spec/ and the code say the same: every structure with a fields() list has a table in the section that it names, with
the same fields in the same order, types, and ranges where both are numbers; and every section that code or text cites is there.
Prints what differs; exit 1 when something does.

usage: syntax_rules.py ROOT"""

import re
import sys
from pathlib import Path

SOURCES = ["base", "codec", "container", "io", "inspect", "muxer", "cli", "tests", "bench"]
TEXTS = ["notation", "codec", "container", "mappings"]

# Rows of a table that are no fields of the structure, and fields that stand in the section's sentences.
NO_FIELDS = {"container 3.1": {"payload crc"}}
IN_WORDS = {"container 6.2": {"count"}}

# Calls of a visitor -> types of the texts.
TYPES = {"varint": "varint", "signedVarint": "svarint", "f64": "f64", "f32": "f32", "array": r"bytes\[\d+\]", "blob": "blob",
         "text": "text", "fixed": r"u(8|16|32|64)"}
FIELD = re.compile(r'v\.(\w+)\(\s*"([^"]+)"\s*,\s*((?:[^()]|\((?:[^()]|\([^()]*\))*\))*)\)')
STRUCT = re.compile(r'kSpec = "((?:codec|container|mappings) [\d.]+)"')
CITED = re.compile(r"\b(notation|codec|container|mappings)(?:\.md,?)?(?: section)? (\d+(?:\.\d+)*)\b(?!\^|-| bytes)")
HEADING = re.compile(r"^#{2,4} (\d+(?:\.\d+)*) ", re.MULTILINE)


def bare(name):
    """Names compare without case, underscores and plural."""
    return re.sub(r"(?<!s)s\b", "", name.lower().replace("_", " "))


# ---- The code -----------------------------------------------------------------------------------------------------------------


def constants(sources):
    """Values of all `constexpr … kName = …` that are numbers."""
    found, pending = {}, {}
    for text in sources.values():
        for name, value in re.findall(r"constexpr [\w:<> ]*?\b(k\w+)\s*=\s*([^;]+);", text):
            pending.setdefault(name, value)
        for name, value in re.findall(r"\b(k\w+) = (\d+)u?[,;]", text):
            pending.setdefault(name, value)
    for _ in range(4):  # constants made of constants
        for name, value in pending.items():
            number = evaluated(value, found)
            if number is not None:
                found[name] = number
    return found


def evaluated(expression, known):
    """The number that a C++ expression stands for, or None."""
    plain = re.sub(r"std::u?int\d+_t\{(\d+)\}", r"\1", expression)
    plain = re.sub(r"\b\w+::(?=k)", "", plain)
    plain = re.sub(r"\b(\d+|0x[0-9a-fA-F]+)[uUlL]+\b", r"\1", plain)
    plain = re.sub(r"\bk\w+", lambda m: str(known.get(m.group(), "?")), plain).replace("/", "//")
    if not re.fullmatch(r"[\d\sx<>+*/()a-fA-F-]+", plain):
        return None
    try:
        return eval(plain, {"__builtins__": {}})  # digits and operators only
    except SyntaxError:
        return None


def body_of_fields(text, at):
    """What stands between the braces of the fields() that follows `at`."""
    start = text.index("{", text.index(" fields(", at))
    depth = 0
    for end in range(start, len(text)):
        depth += {"{": 1, "}": -1}.get(text[end], 0)
        if depth == 0:
            return text[start:end]
    return text[start:]


def fields_in_code(sources):
    """Section -> [(name, call, arguments)], of all structures that name it, in the order of the code."""
    sections, structures = {}, {}
    for text in sources.values():
        for match in STRUCT.finditer(text):
            if " fields(" not in text[match.end():]:
                continue
            name = re.findall(r"\bstruct (\w+)", text[:match.start()])[-1]
            if name in structures:
                sys.exit(f"two structures are called {name}: give one another name")
            structures[name] = match[1], body_of_fields(text, match.end())

    def fields_of(body):
        for part in re.split(r"(\w+::fields\(v\))", body):  # those of a base class stand in its own list
            if part.endswith("::fields(v)"):
                yield from fields_of(structures[part.split(":")[0]][1])
            else:
                yield from ((name, call, [a.strip() for a in arguments.split(",")][1:])
                            for call, name, arguments in FIELD.findall(part) if call in TYPES)

    for section, body in structures.values():
        sections.setdefault(section, []).extend(fields_of(body))
    return sections


# ---- The texts ----------------------------------------------------------------------------------------------------------------


def section_text(text, number):
    """From its heading to the next heading of any level, or None."""
    match = re.search(rf"^#{{2,4}} {re.escape(number)} .*$", text, re.MULTILINE)
    if not match:
        return None
    following = re.compile(r"^#{2,4} ", re.MULTILINE).search(text, match.end())
    return text[match.end():following.start() if following else len(text)]


def rows_of_fields(section):
    """(name, type, range) of every table that has a column `field`; rows without a type are no fields."""
    rows, columns, quoted = [], None, False
    for line in section.splitlines():
        if not line.startswith("|"):
            columns = None
            continue
        cells = [cell.strip() for cell in line.strip("|").split("|")]
        if columns is None:
            columns = cells
            continue
        if "field" not in columns or set(line) <= set("|- "):
            continue
        row = dict(zip(columns, cells))
        name, kind = row["field"], row.get("type", "").replace("`", "")
        structure = kind.startswith("sized") or kind.startswith("bytes[") and not re.match(r"bytes\[\d", kind)
        if not kind or structure or name == "length" and "of the fields that follow" in row.get("meaning", ""):
            continue
        for one in name.replace("`", "").split(", "):
            rows.append((one, kind, row.get("range", row.get("value", "")).replace("`", "")))
    return rows


def number(text):
    """16384, 2^28 - 1, −1023; None for words."""
    plain = text.replace("−", "-").strip()
    if not re.fullmatch(r"-?\d+(\^\d+)?( [+-] \d+(\^\d+)?)*", plain):
        return None
    return eval(plain.replace("^", "**"), {"__builtins__": {}})


def bounds(text):
    """Least and most that a range says; None for what it leaves open or says in words."""
    simple = r"(-?[\d^−]+(?: [−+-] \d+)?)"
    for pattern, least, most in ((rf"{simple} to {simple}(?: bytes)?", 1, 2), (rf"at most {simple}(?: bytes)?", 0, 1),
                                 (rf"{simple} or more", 1, 0)):
        match = re.fullmatch(pattern, text)
        if match:
            return (number(match[least]) if least else None), (number(match[most]) if most else None)
    return None, None


# ---- Both ---------------------------------------------------------------------------------------------------------------------


def belongs(name, row):
    """'time base numerator' is of the row 'time base', 'tangential weight' of 'weights'."""
    return bare(name) == bare(row) or bare(name).startswith(bare(row) + " ") or bare(name).endswith(" " + bare(row))


def compare(section, fields, rows, known):
    """Yields what differs between the code's fields and the table's rows; then how many ranges were numbers on both sides."""
    fields, compared = list(fields), 0
    for name, kind, allowed in rows:
        if not fields or not belongs(fields[0][0], name):
            yield f"spec {section}: '{name}' is due where the code has '{fields[0][0] if fields else 'no more'}'"
            return
        exact = bare(fields[0][0]) == bare(name)
        while fields and (bare(fields[0][0]) == bare(name) if exact else belongs(fields[0][0], name)):
            field, call, arguments = fields.pop(0)
            plain = re.sub(r" \(u32\)|^.*× |[()]", "", kind)
            if not re.fullmatch(TYPES[call], plain):
                yield f"spec {section}: '{name}' is {kind}, and v.{call}() in the code"
            low, high = bounds(allowed)
            ours = [evaluated(a, known) for a in arguments]
            if call in ("blob", "text"):
                ours = [None, *ours]
            for text, code in zip((low, high), ours):
                compared += text is not None and code is not None
                if text is not None and code is not None and text != code and not (text == 2 ** 32 - 1 or low is None and code == 0):
                    yield f"spec {section}: '{name}' is {allowed}, and {' to '.join(arguments)} in the code"
    if fields:
        yield f"spec {section}: the code has '{fields[0][0]}', which the table has not"
    yield compared


def breaches(root):
    """What differs, and how much was compared: (structures, fields, ranges, citations)."""
    texts = {name: (root / "spec" / f"{name}.md").read_text() for name in TEXTS}
    files = [p for folder in SOURCES for p in sorted((root / folder).rglob("*")) if p.suffix in (".h", ".cc", ".py")]
    files += sorted((root / "spec").glob("*.md")) + sorted((root / "spec/reference_decoder").glob("*.py"))
    sources = {p.relative_to(root).as_posix(): p.read_text() for p in files if "/build/" not in p.as_posix()}
    code = {name: text for name, text in sources.items() if name.endswith((".h", ".cc"))}
    known, found, ranges, count = constants(code), [], 0, 0
    sections = fields_in_code({n: t for n, t in code.items() if not n.startswith("tests/")})
    for section, fields in sections.items():
        name, place = section.split()
        text = section_text(texts[name], place)
        if text is None:
            continue  # told below
        rows = [row for row in rows_of_fields(text) if bare(row[0]) not in NO_FIELDS.get(section, ())]
        fields = [f for f in fields if f[0] not in IN_WORDS.get(section, ()) or f"`{f[0]}`" not in text]
        count += len(fields)
        for told in compare(section, fields, rows, known):
            if isinstance(told, int):
                ranges += told
            else:
                found.append(told)
    headings = {name: set(HEADING.findall(text)) for name, text in texts.items()}
    citations = 0
    for name, text in sources.items():
        for match in CITED.finditer(text):
            citations += 1
            if match[2] not in headings[match[1]]:
                found.append(f"{name}:{text.count(chr(10), 0, match.start()) + 1}: there is no section {match[1]} {match[2]}")
    return found, (len(sections), count, ranges, citations)


def main():
    if len(sys.argv) != 2:
        print(__doc__, file=sys.stderr)
        return 2
    found, counts = breaches(Path(sys.argv[1]))
    print("\n".join(found) or "%d sections with %d fields, %d ranges and %d citations agree" % counts)
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
