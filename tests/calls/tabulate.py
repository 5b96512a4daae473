"""Turns what `test_bad_arguments expected.txt --observe` prints into the table of expected.txt: what the rules at its
head do not say already, grouped. Its output is reviewed by eye before it is committed: each line is a promise."""

import fnmatch
import re
import sys
from collections import defaultdict
from pathlib import Path

MARK = "# Exceptions, function by function."


def rules_of(text):
    rules = []
    for line in text.splitlines():
        words = line.partition("#")[0].split()
        if len(words) == 4:
            rules += [(words[0], words[1], what, words[3]) for what in words[2].split(",")]
    return rules


def by_rule(rules, key):
    for *patterns, status in reversed(rules):
        if all(fnmatch.fnmatchcase(text, pattern) for text, pattern in zip(key, patterns, strict=True)):
            return status
    return "invalid_argument"


def main(observed, table):
    path = Path(table)
    head = path.read_text().partition(MARK)[0]
    rules = rules_of(head)
    lines = [line.partition("#")[0].split() for line in Path(observed).read_text().splitlines()]
    cases = {(function, where, what): status for function, where, what, status in lines}
    # function, place with its indices left out, status -> the places and what was done there.
    groups = defaultdict(lambda: defaultdict(list))
    everywhere = defaultdict(set)
    for (function, where, what), status in cases.items():
        everywhere[function, re.sub(r"<\w+>", "<*>", where), what].add((where, status))
    out = []
    for function, where, what in cases:
        status = cases[function, where, what]
        if status == by_rule(rules, (function, where, what)):
            continue
        wide = re.sub(r"<\w+>", "<*>", where)
        alike = {s for _, s in everywhere[function, wide, what]} == {status}
        place = wide if alike else where
        whats = groups[function, status][place]
        if what not in whats:
            whats.append(what)
    for (function, status), places in groups.items():
        merged = defaultdict(list)
        for place, whats in places.items():
            merged[",".join(whats)].append(place)
        for whats, names in merged.items():
            out += [f"{function} {name} {whats} {status}" for name in names]
    path.write_text(head + MARK + "\n" + "\n".join(sorted(out)) + "\n")


if __name__ == "__main__":
    main(*sys.argv[1:])
