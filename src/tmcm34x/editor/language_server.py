"""The language server: `editor.analysis` over the Language Server Protocol.

Thin on purpose: each method asks the analysis and turns characters into the client's units and back.  One
`TmclServer` is one session with one client; `editor.sessions` brings the messages.

Options, from `initializationOptions` and from the section `tmcl` of the configuration: `model` (341, 342, 343),
`includePath` (folders), `hints` (some of address, parameter, value), `rulesOn` and `rulesOff` (codes of the linter).

Source: Language Server Protocol 3.17.
"""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable, Iterable, Sequence
from functools import cache, partial
from threading import Lock
from typing import Any, Final, cast

from lsprotocol import types
from pygls.exceptions import JsonRpcException, JsonRpcInvalidParams
from pygls.lsp.server import LanguageServer
from pygls.protocol import default_converter

from tmcm34x import __version__
from tmcm34x.editor.analysis import actions, appearance, completions, hovers, names, values
from tmcm34x.editor.analysis.program import Analysis, TextPosition
from tmcm34x.editor.analysis.values import HintKind
from tmcm34x.editor.changes import Units, column, replaced
from tmcm34x.editor.conversion import FOLD_KINDS, LEGEND, Converter, markdown, name_of, uri_of
from tmcm34x.editor.workspace import Files, Workspace
from tmcm34x.toolchain.diagnostics import Location
from tmcm34x.toolchain.linter import DEFAULT, RULES

_HINTS: Final[frozenset[HintKind]] = frozenset({"address", "parameter", "value"})
PAUSE_S: Final = 0.005
"""Changes that come closer together are judged once."""
_MOST_DIAGNOSTICS: Final = 500
"""Of a file; rubbish pasted into an editor has no use for more."""


def _unanswered(record: logging.LogRecord) -> bool:
    """Keeps refusals out of the log: the editor has them as answers."""
    refused = record.exc_info and isinstance(record.exc_info[1], JsonRpcException)
    return not refused and not str(record.msg).startswith("Unable to deserialize message")


logging.getLogger("pygls.protocol.json_rpc").addFilter(_unanswered)
# pygls warns of each question that an editor takes back after it was answered.
logging.getLogger("pygls").setLevel(logging.ERROR)

_shared_converter = cache(default_converter)
"""One for all sessions: what each makes as it goes is kept by the interpreter for ever."""
_CONVERTER_LOCK: Final = Lock()


def _converter() -> Any:
    """The converter, made by one thread: the first one changes the protocol's types while it goes through them."""
    with _CONVERTER_LOCK:
        return _shared_converter()


class TmclServer(LanguageServer):
    """One session with an editor.

    files: those that are not open
    """

    def __init__(self, files: Files, include_path: Sequence[str] = (), model: int = 343) -> None:
        super().__init__(  # pyright: ignore[reportUnknownMemberType]
            "tmcm34x",
            __version__,
            text_document_sync_kind=types.TextDocumentSyncKind.Incremental,
            converter_factory=_converter,
        )
        self.programs = Workspace(files, include_path, model)
        self.hints: frozenset[HintKind] = _HINTS
        self._changed: set[str] = set()
        self._timer: asyncio.TimerHandle | None = None
        for name, handler, options in self._features():
            # pygls marks its handlers, which a bound method does not allow.
            self.feature(name, options)(partial(handler))

    def _features(self) -> tuple[tuple[str, Callable[[Any], Any], object], ...]:
        """Methods of the protocol, what answers them, and their options."""
        return (
            (types.INITIALIZE, self._initialize, None),
            (types.WORKSPACE_DID_CHANGE_CONFIGURATION, self._configure, None),
            (types.WORKSPACE_DID_CHANGE_WATCHED_FILES, self._files_changed, None),
            (types.TEXT_DOCUMENT_DID_OPEN, self._open, None),
            (types.TEXT_DOCUMENT_DID_CHANGE, self._change, None),
            (types.TEXT_DOCUMENT_DID_SAVE, self._save, None),
            (types.TEXT_DOCUMENT_DID_CLOSE, self._close, None),
            (types.TEXT_DOCUMENT_HOVER, self._hover, None),
            (types.TEXT_DOCUMENT_COMPLETION, self._complete,
             types.CompletionOptions(trigger_characters=[",", " ", "$", "#"])),
            (types.TEXT_DOCUMENT_SIGNATURE_HELP, self._signature,
             types.SignatureHelpOptions(trigger_characters=[" ", ","])),
            (types.TEXT_DOCUMENT_DEFINITION, self._definition, None),
            (types.TEXT_DOCUMENT_REFERENCES, self._references, None),
            (types.TEXT_DOCUMENT_DOCUMENT_HIGHLIGHT, self._highlights, None),
            (types.TEXT_DOCUMENT_PREPARE_RENAME, self._prepare_rename, None),
            (types.TEXT_DOCUMENT_RENAME, self._rename, types.RenameOptions(prepare_provider=True)),
            (types.TEXT_DOCUMENT_DOCUMENT_SYMBOL, self._symbols, None),
            (types.TEXT_DOCUMENT_FOLDING_RANGE, self._folds, None),
            (types.TEXT_DOCUMENT_FORMATTING, self._format, None),
            (types.TEXT_DOCUMENT_CODE_ACTION, self._actions,
             types.CodeActionOptions(code_action_kinds=[types.CodeActionKind.QuickFix])),
            (types.TEXT_DOCUMENT_SEMANTIC_TOKENS_FULL, self._colours, LEGEND),
            (types.TEXT_DOCUMENT_SEMANTIC_TOKENS_RANGE, self._colours, LEGEND),
            (types.TEXT_DOCUMENT_INLAY_HINT, self._inlay_hints, None),
        )  # fmt: skip

    # Options

    def _initialize(self, params: types.InitializeParams) -> None:
        self._take_options(params.initialization_options)

    def _configure(self, params: types.DidChangeConfigurationParams) -> None:
        settings = _mapping(params.settings)
        self._take_options(settings.get("tmcl", settings))
        self._judge_all()

    def _take_options(self, options: object) -> None:
        values = _mapping(options)
        model = values.get("model")
        if model in (341, 342, 343):
            self.programs.set_model(cast("int", model))
        folders = values.get("includePath")
        if isinstance(folders, list):
            self.programs.include_path = [str(folder) for folder in cast("list[object]", folders)]
            self.programs.refresh()
        if "rulesOn" in values or "rulesOff" in values:
            on, off = (frozenset(_codes(values.get(key))) for key in ("rulesOn", "rulesOff"))
            self.programs.set_rules((DEFAULT | on) - off)
        hints = values.get("hints")
        if isinstance(hints, list):
            wanted = cast("list[object]", hints)
            self.hints = frozenset(kind for kind in _HINTS if kind in wanted)

    # Texts

    def _open(self, params: types.DidOpenTextDocumentParams) -> None:
        self._put(params.text_document.uri, params.text_document.text)

    def _change(self, params: types.DidChangeTextDocumentParams) -> None:
        text = self.programs.texts.get(name_of(params.text_document.uri), "")
        for change in params.content_changes:
            if isinstance(change, types.TextDocumentContentChangeWholeDocument):
                text = change.text
            else:
                start, end = change.range.start, change.range.end
                places = ((start.line, start.character), (end.line, end.character))
                text = replaced(text, *places, change.text, self._encoding)
        self._put(params.text_document.uri, text)

    def _save(self, _params: types.DidSaveTextDocumentParams) -> None:
        self.programs.refresh()
        self._judge_all()

    def _files_changed(self, _params: types.DidChangeWatchedFilesParams) -> None:
        self.programs.refresh()
        self._judge_all()

    def _close(self, params: types.DidCloseTextDocumentParams) -> None:
        name = name_of(params.text_document.uri)
        others = [other for other in self.programs.together(name) if other != name]
        self.programs.close(name)
        self._changed.discard(name)
        self.text_document_publish_diagnostics(types.PublishDiagnosticsParams(params.text_document.uri, []))
        self._judge(others)

    def _put(self, uri: str, text: str) -> None:
        self.programs.put(name_of(uri), text)
        self._judge((name_of(uri),))

    def _judge_all(self) -> None:
        self._judge(self.programs.texts)

    def _judge(self, names: Iterable[str]) -> None:
        """Publishes what is found in some files, and in those that belong together with them, in a moment."""
        self._changed.update(names)
        if self._timer is not None:
            self._timer.cancel()
        self._timer = asyncio.get_running_loop().call_later(PAUSE_S, self._publish)

    def _publish(self) -> None:
        changed, self._changed = self._changed, set()
        names = {other for name in changed for other in (name, *self.programs.together(name))}
        for name in sorted(names & self.programs.texts.keys()):
            analysis = self.programs.analysis(name)
            found = analysis.diagnostics(name)[:_MOST_DIAGNOSTICS]
            items = list(map(self._to(analysis).diagnostic, found))
            self.text_document_publish_diagnostics(types.PublishDiagnosticsParams(uri_of(name), items))

    # Questions

    def _hover(self, params: types.HoverParams) -> types.Hover | None:
        analysis, place = self._place(params)
        hover = hovers.hover(analysis, place)
        if hover is None:
            return None
        return types.Hover(markdown(hover.text), self._to(analysis).range(hover.location))

    def _complete(self, params: types.CompletionParams) -> types.CompletionList:
        analysis, place = self._place(params)
        word = completions.WORD.search(analysis.text(place.file, place.line)[: place.column])
        start = word.start() if word is not None else place.column
        to = self._to(analysis)
        written = to.range(Location(place.file, place.line + 1, start + 1, place.column + 1))
        found = completions.completions(analysis, place)
        items = [to.completion(item, n, written) for n, item in enumerate(found)]
        return types.CompletionList(is_incomplete=False, items=items)

    def _signature(self, params: types.SignatureHelpParams) -> types.SignatureHelp | None:
        analysis, place = self._place(params)
        signature = completions.signature(analysis, place)
        if signature is None:
            return None
        parameters = [types.ParameterInformation(label, document) for label, document in signature.parameters]
        # The active parameter is sent twice: an editor with LSP 3.18 takes the signature's null for none.
        information = types.SignatureInformation(
            signature.label, signature.documentation, parameters, signature.active
        )
        return types.SignatureHelp([information], 0, signature.active)

    def _definition(self, params: types.DefinitionParams) -> types.Location | None:
        analysis, place = self._place(params)
        location = names.definition(analysis, place)
        return self._to(analysis).location(location) if location is not None else None

    def _references(self, params: types.ReferenceParams) -> list[types.Location]:
        analysis, place = self._place(params)
        found = names.references(analysis, place, definition=params.context.include_declaration)
        return [self._to(analysis).location(location) for location in found]

    def _highlights(self, params: types.DocumentHighlightParams) -> list[types.DocumentHighlight]:
        analysis, place = self._place(params)
        found = names.references(analysis, place)
        here = (location for location in found if location.file == place.file)
        return [types.DocumentHighlight(self._to(analysis).range(location)) for location in here]

    def _prepare_rename(self, params: types.PrepareRenameParams) -> types.Range | None:
        analysis, place = self._place(params)
        found = analysis.symbol_at(place)
        return self._to(analysis).range(found[1]) if found is not None else None

    def _rename(self, params: types.RenameParams) -> types.WorkspaceEdit:
        analysis, place = self._place(params)
        try:
            edits = names.rename(analysis, place, params.new_name)
        except ValueError as error:
            raise JsonRpcInvalidParams(str(error)) from error
        return self._to(analysis).workspace_edit(edits)

    def _symbols(self, params: types.DocumentSymbolParams) -> list[types.DocumentSymbol]:
        analysis, name = self._document(params)
        return list(map(self._to(analysis).symbol, names.outline(analysis, name)))

    def _folds(self, params: types.FoldingRangeParams) -> list[types.FoldingRange]:
        analysis, name = self._document(params)
        return [
            types.FoldingRange(f.first, f.last, kind=FOLD_KINDS[f.kind])
            for f in appearance.folds(analysis, name)
        ]

    def _format(self, params: types.DocumentFormattingParams) -> list[types.TextEdit]:
        analysis, name = self._document(params)
        return list(map(self._to(analysis).edit, actions.format_edits(analysis, name)))

    def _actions(self, params: types.CodeActionParams) -> list[types.CodeAction]:
        only = params.context.only
        if only and not {types.CodeActionKind.Empty, types.CodeActionKind.QuickFix} & set(only):
            return []
        analysis, name = self._document(params)
        found = actions.actions(analysis, name, params.range.start.line, params.range.end.line)
        return list(map(self._to(analysis).action, found))

    def _colours(
        self, params: types.SemanticTokensParams | types.SemanticTokensRangeParams
    ) -> types.SemanticTokens:
        analysis, name = self._document(params)
        lines = (0, 2**31)
        if isinstance(params, types.SemanticTokensRangeParams):
            lines = (params.range.start.line, params.range.end.line)
        return self._to(analysis).colours(name, appearance.colours(analysis, name, *lines))

    def _inlay_hints(self, params: types.InlayHintParams) -> list[types.InlayHint]:
        analysis, name = self._document(params)
        found = values.hints(analysis, name, params.range.start.line, params.range.end.line)
        to = self._to(analysis)
        return [to.hint(name, hint) for hint in found if hint.kind in self.hints]

    # From and to the client's units

    def _document(self, params: Any) -> tuple[Analysis, str]:
        name = name_of(params.text_document.uri)
        if name not in self.programs.texts:
            raise JsonRpcInvalidParams(f"not open: {params.text_document.uri}")
        return self.programs.analysis(name), name

    def _place(self, params: Any) -> tuple[Analysis, TextPosition]:
        analysis, name = self._document(params)
        line, units = params.position.line, params.position.character
        text = analysis.text(name, line)
        return analysis, TextPosition(name, line, column(text, units, self._encoding))

    @property
    def _encoding(self) -> Units:
        """The units that the client counts characters in."""
        encoding = self.workspace.position_encoding
        return cast("Units", getattr(encoding, "value", encoding) or "utf-16")

    def _to(self, analysis: Analysis) -> Converter:
        return Converter(analysis, self._encoding)


def _codes(value: object) -> list[str]:
    """Codes of rules as a client sends them; what is no list of known ones counts as none."""
    codes = cast("list[object]", value) if isinstance(value, list) else []
    return [str(code).upper() for code in codes if str(code).upper() in RULES]


def _mapping(value: object) -> dict[str, object]:
    """Options as a client sends them; anything else than an object counts as none."""
    return cast("dict[str, object]", value) if isinstance(value, dict) else {}
