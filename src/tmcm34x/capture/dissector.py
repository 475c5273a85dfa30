"""A dissector for Wireshark, in Lua, made from the tables: it names commands, parameters and statuses.

It takes packets of LINKTYPE_USER0 in the layout of `pcapng`.  Without a preference of the user it registers itself for
that link type.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Final

from tmcm34x.capture.pcapng import HEAD, KINDS
from tmcm34x.tmcl.axis_parameters import AXIS_PARAMETERS
from tmcm34x.tmcl.commands import BY_NUMBER, Command
from tmcm34x.tmcl.global_parameters import GLOBAL_PARAMETERS
from tmcm34x.tmcl.status import STATUS_TEXTS

_TEMPLATE: Final = """\
-- TMCL of TMCM-341, 342 and 343 in packets of LINKTYPE_USER0.  Made by `tmcm34x show --dissector`; do not edit.
-- Put it into Wireshark's folder for plugins (Help, About, Folders, Personal Lua Plugins).

local commands = %(commands)s
local words = %(words)s
local axis = %(axis)s
local globals = %(globals)s
local statuses = %(statuses)s
local axis_commands = %(axis_commands)s
local global_commands = %(global_commands)s

local tmcl = Proto("tmcl", "TMCL")
local f = {
  direction = ProtoField.uint8("tmcl.direction", "Direction", base.DEC,
    {[0] = "to the module", [1] = "from the module"}),
  kind = ProtoField.uint8("tmcl.kind", "Kind", base.DEC, %(kinds)s),
  identifier = ProtoField.uint32("tmcl.can_id", "CAN identifier", base.HEX),
  address = ProtoField.uint8("tmcl.address", "Address", base.DEC),
  host = ProtoField.uint8("tmcl.host", "Host address", base.DEC),
  command = ProtoField.uint8("tmcl.command", "Command", base.DEC, commands),
  type = ProtoField.uint8("tmcl.type", "Type", base.DEC),
  motor = ProtoField.uint8("tmcl.motor", "Motor or bank", base.DEC),
  parameter = ProtoField.string("tmcl.parameter", "Parameter"),
  status = ProtoField.uint8("tmcl.status", "Status", base.DEC, statuses),
  value = ProtoField.int32("tmcl.value", "Value", base.DEC),
  checksum = ProtoField.uint8("tmcl.checksum", "Checksum", base.HEX),
  checksum_ok = ProtoField.bool("tmcl.checksum.ok", "Checksum is right"),
  text = ProtoField.string("tmcl.text", "Text"),
  bytes = ProtoField.bytes("tmcl.bytes", "Bytes"),
}
for _, field in pairs(f) do table.insert(tmcl.fields, field) end
local wrong_sum = ProtoExpert.new("tmcl.checksum.wrong", "Wrong checksum", expert.group.CHECKSUM, expert.severity.WARN)
local refused = ProtoExpert.new("tmcl.refused", "Refused", expert.group.RESPONSE_CODE, expert.severity.NOTE)
tmcl.experts = {wrong_sum, refused}

local function name_of(command, type, motor)
  local name = commands[command] or tostring(command)
  local word = words[command] and words[command][type]
  return word and (name .. " " .. word) or name
end

local function parameter_of(command, type, motor)
  if axis_commands[command] then return axis[type] end
  if global_commands[command] then return globals[motor * 256 + type] end
end

local function add_sum(tree, data)
  local sum = 0
  for n = 0, 7 do sum = (sum + data(n, 1):uint()) %% 256 end
  local item = tree:add(f.checksum, data(8, 1))
  tree:add(f.checksum_ok, sum == data(8, 1):uint())
  if sum ~= data(8, 1):uint() then item:add_proto_expert_info(wrong_sum) end
end

local function request(tree, data, start)
  local command, type, motor = data(start, 1):uint(), data(start + 1, 1):uint(), data(start + 2, 1):uint()
  local value = data(start + 3, 4):int()
  tree:add(f.command, data(start, 1))
  tree:add(f.type, data(start + 1, 1))
  tree:add(f.motor, data(start + 2, 1))
  local parameter = parameter_of(command, type, motor)
  if parameter then tree:add(f.parameter, data(start + 1, 1), parameter) end
  tree:add(f.value, data(start + 3, 4))
  return string.format("%%s %%d, %%d, %%d%%s", name_of(command, type, motor), type, motor, value,
    parameter and (" (" .. parameter .. ")") or "")
end

local function reply(tree, data, start)
  local status, command, value = data(start, 1):uint(), data(start + 1, 1):uint(), data(start + 2, 4):int()
  local item = tree:add(f.status, data(start, 1))
  tree:add(f.command, data(start + 1, 1))
  tree:add(f.value, data(start + 2, 4))
  if status < 100 then item:add_proto_expert_info(refused) end
  local meaning = statuses[status] or "unknown status"
  return string.format("%%d %%s, %%s, %%d", status, meaning, name_of(command, -1, 0), value)
end

local function is_version(data, start)
  local text = data:raw(start)
  return text:match("^34[123][VB]%%d%%.%%d%%d") ~= nil
end

local function body(tree, data, kind, from)
  if kind == 0 and data:len() == 9 then
    if from and is_version(data:bytes(), 1) then
      tree:add(f.host, data(0, 1))
      tree:add(f.text, data(1, 8))
      return "version " .. data(1, 8):string()
    end
    local text
    if from then
      tree:add(f.host, data(0, 1))
      tree:add(f.address, data(1, 1))
      text = reply(tree, data, 2)
    else
      tree:add(f.address, data(0, 1))
      text = request(tree, data, 1)
    end
    add_sum(tree, data)
    return text
  end
  if kind == 1 and data:len() >= 7 then
    if from then
      tree:add(f.address, data(0, 1))
      return reply(tree, data, 1)
    end
    return request(tree, data, 0)
  end
  if kind == 2 then
    tree:add(f.text, data())
    return data():string()
  end
  tree:add(f.bytes, data())
  return "incomplete"
end

function tmcl.dissector(buffer, pinfo, root)
  if buffer:len() <= %(head)d or buffer(0, 1):uint() ~= 1 then return 0 end
  local direction, kind = buffer(1, 1):uint(), buffer(2, 1):uint()
  local tree = root:add(tmcl, buffer())
  tree:add(f.direction, buffer(1, 1))
  tree:add(f.kind, buffer(2, 1))
  if kind == 1 then tree:add(f.identifier, buffer(4, 4)) end
  pinfo.cols.protocol = "TMCL"
  pinfo.cols.src = direction == 0 and "host" or "module"
  pinfo.cols.dst = direction == 0 and "module" or "host"
  local text = body(tree, buffer(%(head)d):tvb(), kind, direction == 1)
  pinfo.cols.info = text
  tree:append_text(": " .. text)
  return buffer:len()
end

DissectorTable.get("wtap_encap"):add(wtap.USER0, tmcl)
"""


def dissector() -> str:
    """The text of the dissector."""
    rows = BY_NUMBER.values()
    return _TEMPLATE % {
        "commands": _table({row.number: row.mnemonic or f"{row.number} {row.title}" for row in rows}),
        "words": _words(),
        "axis": _table({row.number: row.name for row in AXIS_PARAMETERS}),
        "globals": _table({row.bank * 256 + row.number: row.name for row in GLOBAL_PARAMETERS}),
        "statuses": _table({int(number): text for number, text in STATUS_TEXTS.items()}),
        "axis_commands": _set(row for row in rows if _has(row, "axis_parameter")),
        "global_commands": _set(row for row in rows if _has(row, "global_parameter")),
        "kinds": _table(dict(enumerate(KINDS))),
        "head": HEAD.size,
    }


def _has(row: Command, kind: str) -> bool:
    return any(operand.kind == kind for operand in row.operands)


def _quoted(text: str) -> str:
    return '"' + text.replace("\\", "\\\\").replace('"', '\\"') + '"'


def _table(rows: Mapping[int, str]) -> str:
    inner = ", ".join(f"[{number}] = {_quoted(text)}" for number, text in sorted(rows.items()))
    return f"{{{inner}}}"


def _set(rows: Iterable[Command]) -> str:
    return "{" + ", ".join(f"[{row.number}] = true" for row in rows) + "}"


def _words() -> str:
    """The words for the type of a command, such as ABS of MVP."""
    found = {
        row.number: _table({number: word for word, number in operand.words})
        for row in BY_NUMBER.values()
        for operand in row.operands
        if operand.kind == "word" and operand.field == "type"
    }
    return "{" + ", ".join(f"[{number}] = {table}" for number, table in found.items()) + "}"
