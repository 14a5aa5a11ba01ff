"""PLCopen XML (TC6 2.01) of the function block: what TwinCAT, CODESYS and OpenPLC import."""

from __future__ import annotations

from xml.sax.saxutils import escape, quoteattr

from discovery import __version__
from discovery.export.document import Exported
from discovery.export.identifiers import comment
from discovery.export.st.block import st_text
from discovery.export.st.units import Unit, Variable, units

_SECTIONS = {"VAR_INPUT": "inputVars", "VAR_OUTPUT": "outputVars", "VAR": "localVars"}
_ELEMENTARY = {"LREAL", "REAL", "DINT", "BOOL"}


def plcopen_text(exported: Exported, precision: str = "double") -> str:
    """One project with the functions and function blocks of a model."""
    pous = "\n".join(_pou(unit) for unit in units(st_text(exported, precision)))
    name = quoteattr(comment(exported.model.name))
    scales = "".join(f'<{one}><scaling x="1" y="1"/></{one}>' for one in ("fbd", "ld", "sfc"))
    return f"""<?xml version="1.0" encoding="UTF-8"?>
<project xmlns="http://www.plcopen.org/xml/tc6_0201" xmlns:xhtml="http://www.w3.org/1999/xhtml">
  <fileHeader companyName="" productName="discovery" productVersion={quoteattr(__version__)}
              creationDateTime="2000-01-01T00:00:00"
              contentDescription={quoteattr(f"sha256 of the exported model: {exported.seal.sha256}")}/>
  <contentHeader name={name}><coordinateInfo>{scales}</coordinateInfo></contentHeader>
  <types>
    <dataTypes/>
    <pous>
{pous}
    </pous>
  </types>
  <instances><configurations/></instances>
</project>
"""


def _pou(unit: Unit) -> str:
    kind = "function" if unit.kind == "FUNCTION" else "functionBlock"
    returns = f"<returnType><{unit.returns}/></returnType>" if unit.returns else ""
    sections = "".join(
        f"<{tag}>{''.join(_variable(v) for v in unit.variables if v.section == section)}</{tag}>"
        for section, tag in _SECTIONS.items()
        if any(v.section == section for v in unit.variables)
    )
    return f"""      <pou name={quoteattr(unit.name)} pouType="{kind}">
        <interface>{returns}{sections}</interface>
        <body><ST><xhtml:p>{escape(unit.body)}</xhtml:p></ST></body>
      </pou>"""


def _variable(v: Variable) -> str:
    base = f"<{v.type}/>" if v.type in _ELEMENTARY else f"<derived name={quoteattr(v.type)}/>"
    if v.last is not None:
        base = f'<array><dimension lower="0" upper="{v.last}"/><baseType>{base}</baseType></array>'
    initial = f'<initialValue><simpleValue value="{v.initial}"/></initialValue>' if v.initial else ""
    said = f"<documentation><xhtml:p>{escape(v.comment)}</xhtml:p></documentation>" if v.comment else ""
    return f"<variable name={quoteattr(v.name)}><type>{base}</type>{initial}{said}</variable>"
