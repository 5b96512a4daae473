"""From sgrt.h: a struct of arguments for every function (args.hpp), what kind each argument is and how to call it,
and the fields of every public struct (functions.cpp). `generate.py sgrt.h args.hpp functions.cpp`; CMake runs it."""

import re
import sys
from pathlib import Path

SCALARS = {"double": "kDouble", "int32_t": "kInt32", "sgrt_status": "kInt32", "int64_t": "kInt64", "size_t": "kSize"}
FIELDS = {"double": "kDouble", "int32_t": "kInt32", "uint32_t": "kInt32", "sgrt_status": "kInt32", "int64_t": "kInt64"}


def declarations(text):
    """The header without comments, directives and inline functions."""
    text = re.sub(r"/\*.*?\*/", " ", text, flags=re.S)
    text = re.sub(r"^\s*#.*$", "", text, flags=re.M)
    return re.sub(r"static inline .*?^}", "", text, flags=re.S | re.M)


def structs_of(text):
    """name -> [(field, kind, type, count)]."""
    found = {}
    for body, name in re.findall(r"typedef struct \w+ \{(.*?)\}\s*(\w+);", text, flags=re.S):
        fields = found[name] = []
        for declaration in filter(None, (" ".join(part.split()) for part in body.split(";"))):
            if "*" in declaration or re.match(r"sgrt_\w+_fn ", declaration):
                fields.append((re.search(r"(\w+)$", declaration).group(1), "kPointer", "void*", 1))
                continue
            kind, names = re.match(r"(\w+) (.*)", declaration).groups()
            for part in names.split(","):
                field, count = re.match(r"\s*(\w+)(?:\[(\d+)\])?", part).groups()
                fields.append((field, FIELDS.get(kind, "kStruct"), kind, int(count or 1)))
    return found


def kind_of(function, parameter, structs, handles):
    """(C type in the struct of arguments, name, kind, bytes or count, type it is about)."""
    text = " ".join(parameter.split())
    stem, name, count = re.match(r"(.*?)(\w+)(?:\[(\d+)\])?$", text).groups()
    stem = stem.strip()
    constant, base = "const " in stem, stem.replace("const", "").replace("*", "").strip()
    stars = stem.count("*")
    if count:
        number = {"double": 8, "int32_t": 4}[base] * int(count)
        kind = "kOut" if not constant else "kNumbers" if base == "double" else "kIntegers"
        return f"{stem} *", name, kind, number, ""
    if stars == 0:
        return stem, name, SCALARS[base], 0, ""
    if base == "char":
        return stem, name, "kText", 0, ""
    if base == "sgrt_context":
        kind = "kHandleOut" if stars == 2 else "kSession" if function.endswith("_free") else "kContext"
        return stem, name, kind, 8, base
    if base in handles:
        if stars == 1:
            return stem, name, "kHandle" if constant else "kSession", 8, base
        return stem, name, "kHandles" if stem.count("const") == 2 else "kLentOut" if constant else "kHandleOut", 8, base
    if base in structs:
        if base in ("sgrt_view", "sgrt_mut_view") and constant:
            return stem, name, "kView" if base == "sgrt_view" else "kMutView", 0, base
        if constant:
            return stem, name, "kStructIn", 0, base
        return stem, name, "kInitOut" if function.endswith("_init") else "kStructOut", 0, base
    return stem, name, "kOut", {"double": 8, "int32_t": 4, "int64_t": 8}[base], ""


def arguments_of(functions, structs, handles):
    """function -> its arguments, as kind_of gives them."""
    found = {}
    for _, name, parameters in functions:
        each = [] if parameters.strip() == "void" else parameters.split(",")
        found[name] = [kind_of(name, parameter, structs, handles) for parameter in each]
    return found


def struct_lines(structs, names):
    for name, fields in structs.items():
        rows = ", ".join(
            f'{{"{field}", Field::{kind}, offsetof({name}, {field}), {count}, sizeof({type_}), '
            f"{'&struct_of_' + type_ if kind == 'kStruct' else 'nullptr'}}}"
            for field, kind, type_, count in fields
        )
        init = f"reinterpret_cast<Init>({name}_init)" if f"{name}_init" in names else "nullptr"
        sized = str(fields[0][0] == "struct_size").lower()
        yield f'const Struct struct_of_{name} = {{"{name}", sizeof({name}), {sized}, {init}, {{{rows}}}}};'


def function_lines(functions, arguments, structs):
    for result, name, _ in functions:
        rows = ", ".join(
            f'{{"{item}", Param::{kind}, offsetof(Args_{name}, {item}), {size}, "{of}", '
            f"{'&struct_of_' + of if of in structs else 'nullptr'}}}"
            for _, item, kind, size, of in arguments[name]
        )
        call = f"{name}({', '.join(f'a.{item}' for _, item, *_ in arguments[name])})"
        use = f"[[maybe_unused]] auto& a = *static_cast<Args_{name}*>(p);"
        kind = {"void": "kNothing", "sgrt_status": "kStatus"}.get(result.strip(), "kText")
        body = {
            "kNothing": f"{call}; return Answer{{0, nullptr}};",
            "kStatus": f"return Answer{{{call}, nullptr}};",
            "kText": f"return Answer{{0, {call}}};",
        }[kind]
        yield (
            f'    {{"{name}", Function::{kind}, sizeof(Args_{name}), {{{rows}}},\n'
            f"     [](void* p) {{ {use} {body} }},\n"
            f"     static_cast<void (*)(Args_{name}&)>(base) ? +[](void* p) {{ base(*static_cast<Args_{name}*>(p)); }}"
            " : nullptr},"
        )


def main(header, args, table):
    text = declarations(Path(header).read_text())
    structs = structs_of(text)
    handles = set(re.findall(r"typedef struct (\w+) \1;", text))
    functions = re.findall(r"SGRT_API\s+([\w\s]+?[\s*]+)(sgrt_\w+)\s*\((.*?)\);", text, flags=re.S)
    arguments = arguments_of(functions, structs, handles)
    lines = ["// Written by generate.py from sgrt.h.", "#pragma once", "#include <sgrt.h>", "namespace calls {"]
    for name, items in arguments.items():
        members = " ".join(f"{type_} {item};" for type_, item, *_ in items)
        lines.append(f"struct Args_{name} {{ {members} }};")
        lines.append(f"__attribute__((weak)) void base(Args_{name}& a);")
    Path(args).write_text("\n".join([*lines, "}  // namespace calls", ""]))
    lines = ["// Written by generate.py from sgrt.h.", '#include "args.hpp"', '#include "calls.hpp"']
    lines += ["namespace calls {"]
    lines += struct_lines(structs, set(arguments))
    lines += ["const std::vector<Function>& functions() {", "  static const std::vector<Function> all = {"]
    lines += function_lines(functions, arguments, structs)
    lines += ["  };", "  return all;", "}", "void free_handle(const std::string& type, void* handle) {"]
    lines += [
        f'  if (type == "{handle}") return {handle}_free(static_cast<{handle}*>(handle));' for handle in sorted(handles)
    ]
    Path(table).write_text("\n".join([*lines, "}", "}  // namespace calls", ""]))


if __name__ == "__main__":
    main(*sys.argv[1:])
