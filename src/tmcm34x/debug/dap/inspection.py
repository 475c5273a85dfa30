"""Looking at a program, and changing what is seen: stack, scopes, expressions, the console, sources, memory."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any, Final

from tmcm34x.clock import MS
from tmcm34x.debug.dap import messages as m
from tmcm34x.debug.dap.debuggee import Debuggee, Request, parse_address
from tmcm34x.debug.dap.messages import RequestError
from tmcm34x.debug.expressions import ExpressionError, split_assignment
from tmcm34x.debug.sessions.base import StackFrame
from tmcm34x.debug.view import ScopeItem
from tmcm34x.tmcl.commands import BY_MNEMONIC
from tmcm34x.tmcl.datagram import pack_record
from tmcm34x.tmcl.mnemonic import MnemonicError, format_instruction, parse_instruction
from tmcm34x.tmcl.status import STATUS_TEXTS, Status

_UNSAFE_READS: Final = "Reading it does something in the module; click to read."
_WHO_WROTE: Final = re.compile(r"who\s+wrote\b\s*(.*?)\s*\??\s*\Z", re.IGNORECASE)
_NAMES: Final = ("accumulator", "adc", "ap", "co", "counter", "gp", "in", "out", "shutdown", "x")


class Inspector:
    """Answers about the program as it is now; references that it returns are valid until `forget`."""

    def __init__(self, debuggee: Debuggee) -> None:
        self._debuggee = debuggee
        self._handles: dict[int, list[ScopeItem]] = {}
        self._references = 0

    def forget(self) -> None:
        """The program has gone on: what was shown is no longer so."""
        self._handles.clear()

    # Stack and scopes

    def on_stack_trace(self, arguments: m.StackTrace) -> dict[str, Any]:
        """The open routines."""
        frames = self._debuggee.running_or_held.frames()
        first = max(0, arguments.start_frame)
        last = first + arguments.levels if arguments.levels > 0 else len(frames)
        shown = [self._frame(number, frame) for number, frame in list(enumerate(frames))[first:last]]
        return {"stackFrames": shown, "totalFrames": len(frames)}

    def _frame(self, number: int, frame: StackFrame) -> dict[str, Any]:
        body: dict[str, Any] = {"id": number, "name": frame.name, "line": 0, "column": 0}
        body |= self._debuggee.place(frame.address)
        place = frame.location
        if place is not None:
            body |= {"column": place.column, "endLine": body["line"], "endColumn": place.end}
        return body | {"instructionPointerReference": hex(frame.address)}

    def on_scopes(self, _: m.Arguments) -> dict[str, Any]:
        """What there is to look at."""
        target = self._debuggee.running_or_held
        slow = bool(target.steps_for_breakpoints)
        scopes: list[dict[str, Any]] = []
        for title, items in target.view.scopes().items():
            scope = {"name": title, "variablesReference": self._handle_for(items()), "expensive": slow}
            if title == "Registers":
                scope["presentationHint"] = "registers"
            scopes.append(scope)
        return {"scopes": scopes}

    def _handle_for(self, items: list[ScopeItem]) -> int:
        self._references += 1
        self._handles[self._references] = items
        return self._references

    def on_variables(self, arguments: m.Variables) -> dict[str, Any]:
        """The values of a scope."""
        shown_hex = arguments.format is not None and arguments.format.hex
        items = self._items(arguments.variables_reference)
        return {"variables": [self._variable(item, shown_hex) for item in items]}

    def _items(self, reference: int) -> list[ScopeItem]:
        items = self._handles.get(reference)
        if items is None:
            raise RequestError("this was of an earlier stop")
        return items

    def _variable(self, item: ScopeItem, shown_hex: bool) -> dict[str, Any]:
        body: dict[str, Any] = {"name": item.name, "evaluateName": item.expression, "variablesReference": 0}
        hint: dict[str, Any] = {} if item.writable else {"attributes": ["readOnly"]}
        if item.acting:
            asked = item._replace(acting=False)
            body |= {"value": _UNSAFE_READS, "variablesReference": self._handle_for([asked])}
            hint["lazy"] = True
        else:
            body["value"] = self._value(item, shown_hex)
        if item.meaning:
            body["type"] = item.meaning
        return body | ({"presentationHint": hint} if hint else {})

    def _value(self, item: ScopeItem, shown_hex: bool) -> str:
        try:
            value = self._debuggee.running_or_held.view.evaluate(item.expression)
        except ExpressionError as error:
            return f"<{error}>"
        choice = dict(item.choices).get(value)
        return _shown(value, shown_hex) + (f" ({choice})" if choice else "")

    def expression(self, reference: int | None, name: str) -> str:
        """The expression of a member of a scope; without a scope `name` is one."""
        if not reference:
            return name
        for item in self._items(reference):
            if item.name == name:
                return item.expression
        raise RequestError(f"no value named {name}")

    def on_set_variable(self, arguments: m.SetVariable) -> dict[str, Any]:
        """Change something in a scope."""
        return self._assign(self.expression(arguments.variables_reference, arguments.name), arguments.value)

    def on_set_expression(self, arguments: m.SetExpression) -> dict[str, Any]:
        """Change something by name."""
        return self._assign(arguments.expression, arguments.value)

    def _assign(self, target: str, value: str) -> dict[str, Any]:
        assigned = self._debuggee.running_or_held.view.assign(target, value)
        return {"value": str(assigned), "variablesReference": 0}

    def on_exception_info(self, _: m.Arguments) -> dict[str, Any]:
        """What held the program, where a break did."""
        stop = self._debuggee.running_or_held.stop
        if stop is None or stop.reason != "exception":
            raise RequestError("the program is not held by a break")
        return {"exceptionId": stop.exception, "description": stop.text, "breakMode": "always"}

    # Expressions and the console

    def on_evaluate(self, arguments: m.Evaluate) -> dict[str, Any]:
        """An expression; in the console also an assignment, or a command in direct mode."""
        text = arguments.expression.strip()
        if arguments.context == "repl":
            asked = _WHO_WROTE.match(text)
            if asked is not None:
                return {"result": self._who_wrote(asked[1]), "variablesReference": 0}
            words = text.split(maxsplit=1)
            if words and words[0].upper() in BY_MNEMONIC:
                return {"result": self._execute(text), "variablesReference": 0}
            assignment = split_assignment(text)
            if assignment is not None:
                result = self._assign(*assignment)
                self._debuggee.event("invalidated", areas=["variables"])
                return {"result": result["value"], "variablesReference": 0}
        value = self._debuggee.running_or_held.view.evaluate(text)
        shown_hex = arguments.format is not None and arguments.format.hex
        return {"result": _shown(value, shown_hex), "variablesReference": 0}

    def _who_wrote(self, text: str) -> str:
        if not text:
            raise RequestError("who wrote what? Name a value, as in: who wrote gp[3]?")
        write = self._debuggee.running_or_held.who_wrote(text)
        if write is None:
            return f"nothing has written {text} since the history began"
        place = self._debuggee.place(write.address) if write.address >= 0 else {}
        where = f"line {place['line']}: " if "line" in place else ""
        return f"{write.clock / MS:.4f} ms, {where}{write.cause} ({write.before} → {write.after})"

    def _execute(self, text: str) -> str:
        try:
            instruction = parse_instruction(text)
        except MnemonicError as error:
            raise RequestError(str(error)) from None
        status, value = self._debuggee.running_or_held.execute(instruction)
        if status != Status.OK:
            raise RequestError(f"status {status}: {STATUS_TEXTS.get(status, 'unknown status')}")
        self._debuggee.event("invalidated", areas=["variables"])
        reads = "reads" in BY_MNEMONIC[text.split(maxsplit=1)[0].upper()].where
        return str(value) if reads else f"status {status}: {STATUS_TEXTS[status]}"

    def on_completions(self, arguments: m.Completions) -> dict[str, Any]:
        """Names that begin as what was typed."""
        sources = self._debuggee.sources
        match = re.search(r"[A-Za-z_]\w*\Z", arguments.text[: max(0, arguments.column - sources.base)])
        if match is None:
            return {"targets": []}
        start = match[0].upper()
        names = (*BY_MNEMONIC, *_NAMES, *(symbol.name for symbol in sources.symbols.values()))
        found = [name for name in names if name.upper().startswith(start)]
        return {"targets": [{"label": name, "length": len(start), "start": match.start()} for name in found]}

    # Sources and memory

    def on_source(self, arguments: m.GetSource) -> dict[str, Any]:
        """A text that we made."""
        reference = arguments.source_reference or (arguments.source and arguments.source.source_reference)
        return {"content": self._debuggee.sources.made(reference), "mimeType": "text/x-tmcl"}

    def on_loaded_sources(self, _: m.Arguments) -> dict[str, Any]:
        """All files of the program."""
        return {"sources": self._debuggee.sources.sources()}

    def on_disassemble(self, arguments: m.Disassemble) -> dict[str, Any]:
        """A stretch of the program memory."""
        first = parse_address(arguments.memory_reference) + arguments.offset + arguments.instruction_offset
        addresses = range(first, first + arguments.instruction_count)
        assembly = self._debuggee.sources.assembly
        labels = {} if assembly is None else {value: name for name, value in assembly.labels.items()}
        return {"instructions": [self._disassembled(address, labels) for address in addresses]}

    def _disassembled(self, address: int, labels: Mapping[int, str]) -> dict[str, Any]:
        instruction = self._debuggee.instruction(address)
        if instruction is None:
            # Editors ask for rows before the first command, and want an address of its own for each.
            return {"address": hex(address & 0xFFFFFFFF), "instruction": "??", "presentationHint": "invalid"}
        row: dict[str, Any] = {
            "address": hex(address),
            "instruction": format_instruction(instruction, labels),
            "instructionBytes": pack_record(instruction).hex(" "),
        }
        if address in labels:
            row["symbol"] = labels[address]
        place = self._debuggee.sources.place(address)
        return row | ({"location": place["source"], "line": place["line"]} if place else {})


def _shown(value: int, shown_hex: bool) -> str:
    return f"${value & 0xFFFFFFFF:X}" if shown_hex else str(value)


REQUESTS: Final[Mapping[str, Request]] = {
    "stackTrace": Request(m.StackTrace, Inspector.on_stack_trace),
    "scopes": Request(m.Arguments, Inspector.on_scopes),
    "variables": Request(m.Variables, Inspector.on_variables),
    "setVariable": Request(m.SetVariable, Inspector.on_set_variable),
    "setExpression": Request(m.SetExpression, Inspector.on_set_expression),
    "exceptionInfo": Request(m.Arguments, Inspector.on_exception_info),
    "evaluate": Request(m.Evaluate, Inspector.on_evaluate),
    "completions": Request(m.Completions, Inspector.on_completions),
    "source": Request(m.GetSource, Inspector.on_source),
    "loadedSources": Request(m.Arguments, Inspector.on_loaded_sources),
    "disassemble": Request(m.Disassemble, Inspector.on_disassemble),
}
