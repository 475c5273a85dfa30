"""Results of the analysis of a program, in the types of the Language Server Protocol and the client's units.

Source: Language Server Protocol 3.17.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Final, cast

from lsprotocol import types
from pygls import uris

from tmcm34x.editor.analysis.actions import CodeAction
from tmcm34x.editor.analysis.appearance import TOKEN_TYPES, Coloured
from tmcm34x.editor.analysis.completions import Completion
from tmcm34x.editor.analysis.names import Outline
from tmcm34x.editor.analysis.program import Analysis
from tmcm34x.editor.analysis.values import Hint
from tmcm34x.editor.changes import Units, width
from tmcm34x.toolchain.diagnostics import Diagnostic, Edit, Location

SEVERITIES: Final = {
    "error": types.DiagnosticSeverity.Error,
    "warning": types.DiagnosticSeverity.Warning,
    "information": types.DiagnosticSeverity.Information,
}
COMPLETION_KINDS: Final = {
    "command": types.CompletionItemKind.Keyword,
    "word": types.CompletionItemKind.EnumMember,
    "constant": types.CompletionItemKind.Constant,
    "label": types.CompletionItemKind.Reference,
    "function": types.CompletionItemKind.Function,
    "parameter": types.CompletionItemKind.Property,
    "number": types.CompletionItemKind.Value,
    "directive": types.CompletionItemKind.Module,
}
FOLD_KINDS: Final = {
    "comment": types.FoldingRangeKind.Comment,
    "imports": types.FoldingRangeKind.Imports,
    "region": types.FoldingRangeKind.Region,
}
LEGEND: Final = types.SemanticTokensLegend(list(TOKEN_TYPES), ["definition"])
_TYPE_INDEX: Final = {name: index for index, name in enumerate(TOKEN_TYPES)}


class Converter:
    """For one program.

    encoding: the units that the client counts characters in
    """

    def __init__(self, analysis: Analysis, encoding: Units) -> None:
        self._analysis = analysis
        self._encoding: Units = encoding

    # Places

    def _units(self, text: str, column: int) -> int:
        """The characters before `column` in the client's units."""
        return column if text.isascii() else width(text[:column], self._encoding)

    def position(self, name: str, line: int, column: int) -> types.Position:
        """A place; line and column count from 0."""
        return types.Position(line, self._units(self._analysis.text(name, line), column))

    def range(self, location: Location) -> types.Range:
        """A stretch of a line."""
        name, line = location.file, location.line - 1
        start, end = location.column - 1, location.end - 1
        return types.Range(self.position(name, line, start), self.position(name, line, end))

    def location(self, location: Location) -> types.Location:
        """A stretch of a line with its document."""
        return types.Location(uri_of(location.file), self.range(location))

    # Changes

    def edit(self, edit: Edit) -> types.TextEdit:
        """One replacement."""
        return types.TextEdit(self.range(edit.location), edit.text)

    def workspace_edit(self, edits: Iterable[Edit]) -> types.WorkspaceEdit:
        """Replacements in several documents."""
        changes: dict[str, list[types.TextEdit]] = {}
        for edit in edits:
            changes.setdefault(uri_of(edit.location.file), []).append(self.edit(edit))
        return types.WorkspaceEdit(cast("dict[str, Sequence[types.TextEdit]]", changes))

    def action(self, action: CodeAction) -> types.CodeAction:
        """A change that is offered for a diagnostic."""
        return types.CodeAction(
            action.title,
            kind=types.CodeActionKind.QuickFix,
            diagnostics=[self.diagnostic(action.diagnostic)],
            is_preferred=action.preferred,
            edit=self.workspace_edit(action.edits),
        )

    # Findings and words

    def diagnostic(self, item: Diagnostic) -> types.Diagnostic:
        """A finding; what is never reached or used may be shown faded."""
        tags = [types.DiagnosticTag.Unnecessary] if item.code in ("W101", "W401") else None
        return types.Diagnostic(
            self.range(item.location),
            item.text,
            SEVERITIES[item.severity],
            item.code,
            source="tmcl",
            tags=tags,
        )

    def completion(self, item: Completion, number: int, place: types.Range) -> types.CompletionItem:
        """A completion of what stands at a place; `number` is its place in the list."""
        return types.CompletionItem(
            item.label,
            kind=COMPLETION_KINDS[item.kind],
            detail=item.detail or None,
            documentation=markdown(item.documentation) if item.documentation else None,
            sort_text=f"{number:04}",
            filter_text=item.filter or None,
            text_edit=types.TextEdit(place, item.insert),
        )

    def symbol(self, entry: Outline) -> types.DocumentSymbol:
        """A line of the outline."""
        symbol, place = entry.symbol, entry.symbol.definition
        name, last = place.file, entry.last_line - 1
        end = len(self._analysis.text(name, last))
        start = self.position(name, place.line - 1, place.column - 1)
        whole = types.Range(start, self.position(name, last, end))
        if symbol.kind == "constant":
            kind, detail = types.SymbolKind.Constant, f"= {symbol.value:.15g}"
        else:
            kind = types.SymbolKind.Function if entry.is_subroutine else types.SymbolKind.Key
            detail = f"address {symbol.value:g}"
        return types.DocumentSymbol(symbol.name, kind, whole, self.range(place), detail)

    def colours(self, name: str, words: Iterable[Coloured]) -> types.SemanticTokens:
        """The words of a file by type, each placed from the one before."""
        data: list[int] = []
        last_line = last_start = 0
        for word in words:
            text = self._analysis.text(name, word.line)
            start = self._units(text, word.start)
            length = self._units(text, word.start + word.length) - start
            if word.line != last_line:
                last_start = 0
            type_ = _TYPE_INDEX[word.type]
            data += (word.line - last_line, start - last_start, length, type_, int(word.definition))
            last_line, last_start = word.line, start
        return types.SemanticTokens(data)

    def hint(self, name: str, hint: Hint) -> types.InlayHint:
        """A note between the words of a line."""
        at = self.position(name, hint.line, hint.column)
        address = hint.kind == "address"
        kind = types.InlayHintKind.Type if hint.kind == "value" else types.InlayHintKind.Parameter
        return types.InlayHint(at, hint.text, kind, padding_left=not address, padding_right=address)


def markdown(text: str) -> types.MarkupContent:
    """A text in Markdown."""
    return types.MarkupContent(types.MarkupKind.Markdown, text)


def name_of(uri: str) -> str:
    """The name by which the tool chain knows a document: the path of a file, else the URI itself."""
    return (uris.to_fs_path(uri) or uri) if uri.startswith("file:") else uri


def uri_of(name: str) -> str:
    """The URI of a document that `name_of` named."""
    return (uris.from_fs_path(name) or name) if name.startswith("/") else name
