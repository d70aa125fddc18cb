"""The C++ interface: what each header offers, as it stands there, without bodies and private parts.

    ```{cpp-headers} filters
    ```

shows all headers of cpp/include/auvest/filters: the comment that each begins with, then its types
and functions. A declaration of a template says more than a table of its parts, and the comments are
written to be read beside it, so this shows the declarations themselves. tree-sitter finds them: it
reads C++ without include paths or a build, and is two packages of pip where Doxygen is an XML
dialect, another program and another layer of templates.
"""

from __future__ import annotations

import re
import textwrap
from collections.abc import Iterator
from pathlib import Path

import tree_sitter_cpp
from docutils import nodes
from sphinx.application import Sphinx
from sphinx.errors import SphinxError
from sphinx.util.docutils import SphinxDirective
from tree_sitter import Language, Node, Parser

INCLUDE = Path(__file__).resolve().parents[2] / "cpp" / "include" / "auvest"
PARSER = Parser(Language(tree_sitter_cpp.language()))
HIDDEN_NAMESPACES = {"internal", "detail"}
TYPES = {"class_specifier", "struct_specifier", "enum_specifier"}
# Of a class, what says nothing to who uses it.
NOISE = {"using_declaration", "friend_declaration", "static_assert_declaration"}


def read(header: Path) -> str:
    """Return a header without the macros that only tell a compiler how to lay out code."""
    return re.sub(
        r"\bAUVEST_(?:INLINE|OUTLINE(?:_HOT)?|ALWAYS_INLINE|COLD|UNROLL)\b *",
        "",
        header.read_text(encoding="utf-8"),
    )


def tree_of(text: str) -> Node:
    """Return the syntax tree of a header."""
    return PARSER.parse(text.encode()).root_node


def source(node: Node) -> str:
    """Return the text of a node."""
    return (node.text or b"").decode()


def unwrapped(node: Node) -> Node:
    """Return what a template declares, or the node itself; a type for a declaration of only one."""
    while node.type == "template_declaration":
        node = node.named_children[-1]
    if node.type in ("declaration", "field_declaration"):
        inner = node.child_by_field_name("type")
        if inner is not None and inner.type in TYPES and inner.child_by_field_name("body"):
            return inner
    return node


def cuts(node: Node) -> Iterator[tuple[int, int, str]]:
    """Yield the ranges of bytes that are left out, and what stands there instead."""
    if node.type == "function_definition":
        body = node.child_by_field_name("body")
        starts = [c.start_byte for c in node.children if c.type == "field_initializer_list"]
        if body is not None:
            yield min([*starts, body.start_byte]), node.end_byte, ";"
        return
    if node.type == "field_declaration_list" and node.parent is not None:
        public = node.parent.type != "class_specifier"
        comment: Node | None = None
        for child in node.named_children:
            if child.type == "access_specifier":
                public = source(child) == "public"
                if not public or node.parent.type != "class_specifier":
                    yield child.start_byte, child.end_byte + 1, ""
            elif child.type == "comment":
                if comment is None:
                    comment = child
                # A comment behind a member goes with it.
                before = child.prev_named_sibling
                if before is not None and before.end_point[0] == child.start_point[0]:
                    if not public:
                        yield child.start_byte, child.end_byte, ""
                    comment = None
                continue
            elif not public or child.type in NOISE:
                yield (comment or child).start_byte, end_of(child), ""
            else:
                yield from cuts(child)
            comment = None
        return
    for child in node.children:
        yield from cuts(child)


def end_of(node: Node) -> int:
    """Return where a member ends, with the semicolon that may be a node of its own."""
    after = node.next_sibling
    return after.end_byte if after is not None and after.type == ";" else node.end_byte


def interface(node: Node, text: bytes) -> str:
    """Return a declaration without bodies and private members."""
    kept, at = b"", node.start_byte
    for start, end, instead in sorted(cuts(node)):
        if start >= at:
            kept += text[at:start].rstrip(b" ") + instead.encode()
            at = end
    kept += text[at : node.end_byte]
    shown = re.sub(r"[ \t]+$", "", kept.decode(), flags=re.MULTILINE)
    shown = re.sub(r"\s+;$", ";", shown, flags=re.MULTILINE)
    shown = re.sub(r"\n{2,}", "\n\n", shown)
    shown = re.sub(r"(\{|public:)\n\n", r"\1\n", shown)
    shown = re.sub(r"\n(?:\s*\n)?(?: *public:\n)?(?:\s*\n)?( *\})", r"\n\1", shown)
    shown = re.sub(r"\{\s*(?:public:)?\s*\}", "{}", shown)
    indent = b" " * node.start_point[1]
    return textwrap.dedent(indent.decode() + shown).strip()


class Entry:
    """A type or function that a header offers."""

    def __init__(self, name: str, comment: str, code: str, *, is_type: bool) -> None:
        """Take what will be shown."""
        self.name, self.comment, self.code, self.is_type = name, comment, code, is_type


def comment_above(node: Node) -> str:
    """Return the /// lines directly above a declaration."""
    lines: list[str] = []
    below = node
    before = node.prev_sibling
    while before is not None and before.type == "comment":
        adjacent = before.end_point[0] + 1 >= below.start_point[0]
        if not adjacent or not source(before).startswith("///"):
            break
        lines.insert(0, source(before)[3:].removeprefix(" "))
        below, before = before, before.prev_sibling
    return "\n".join(lines).removeprefix("< ")


def entries(node: Node, text: bytes) -> Iterator[Entry]:
    """Yield what the namespaces of a header offer, in its order."""
    for child in node.named_children:
        if child.type == "namespace_definition":
            name = child.child_by_field_name("name")
            if name is None or source(name) not in HIDDEN_NAMESPACES:
                body = child.child_by_field_name("body")
                if body is not None:
                    yield from entries(body, text)
            continue
        if child.type.startswith("preproc_if"):
            yield from entries(child, text)
            continue
        inner = unwrapped(child)
        if inner.type in TYPES:
            name = inner.child_by_field_name("name")
            if name is not None and inner.child_by_field_name("body") is not None:
                code = interface(child, text).rstrip(";") + ";"
                yield Entry(source(name), comment_above(child), code, is_type=True)
        elif inner.type in ("function_definition", "alias_declaration", "declaration"):
            comment = comment_above(child)
            if comment:
                yield Entry("", comment, interface(child, text), is_type=False)


def opening(text: str) -> str:
    """Return the comment that a header begins with."""
    lines = []
    for line in text.splitlines():
        if not line.startswith("//"):
            break
        lines.append(line[2:].removeprefix(" "))
    return "\n".join(lines)


def prose(text: str) -> list[nodes.Node]:
    """Return a comment as paragraphs; what is indented by four stands as it is."""
    shown: list[nodes.Node] = []
    for part in re.split(r"\n\s*\n", text):
        if part.strip() and all(line.startswith("    ") for line in part.splitlines()):
            code = textwrap.dedent(part)
            shown.append(nodes.literal_block(code, code, language="none"))
        elif part.strip():
            paragraph = nodes.paragraph()
            for k, piece in enumerate(part.split("`")):
                paragraph += nodes.literal(piece, piece) if k % 2 else nodes.Text(piece)
            shown.append(paragraph)
    return shown


def code_block(code: str) -> nodes.literal_block:
    """Return C++ as a block of code."""
    return nodes.literal_block(code, code, language="cpp")


class CppHeaders(SphinxDirective):
    """Show all headers of a folder."""

    required_arguments = 1

    def run(self) -> list[nodes.Node]:
        """Return a section for each header."""
        folder = INCLUDE / self.arguments[0]
        headers = sorted(folder.glob("*.hpp"))
        if not headers:
            raise SphinxError(f"{self.env.docname}: no header in {folder}")
        sections = []
        for header in headers:
            self.env.note_dependency(str(header))
            sections.append(self.section(header))
        return list(sections)

    def section(self, header: Path) -> nodes.section:
        """Return what one header offers."""
        text = read(header)
        name = header.relative_to(INCLUDE.parent).as_posix()
        section = self.titled(name, header.stem)
        section += prose(opening(text))
        functions: list[str] = []
        for entry in entries(tree_of(text), text.encode()):
            if entry.is_type:
                part = self.titled(entry.name, f"{header.stem}-{entry.name}")
                part += prose(entry.comment)
                part += code_block(entry.code)
                section += part
            else:
                comment = textwrap.indent(entry.comment, "/// ", lambda _: True)
                functions.append(f"{comment}\n{entry.code}")
        if functions:
            section.insert(
                next(
                    (k for k, n in enumerate(section) if isinstance(n, nodes.section)), len(section)
                ),
                code_block("\n\n".join(functions)),
            )
        return section

    def titled(self, title: str, name: str) -> nodes.section:
        """Return a section with a title and an anchor."""
        section = nodes.section(ids=[nodes.make_id(name)], names=[nodes.fully_normalize_name(name)])
        section += nodes.title(title, title)
        self.state.document.note_implicit_target(section, section)
        return section


def setup(app: Sphinx) -> dict[str, bool]:
    """Register the directive."""
    app.add_directive("cpp-headers", CppHeaders)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
