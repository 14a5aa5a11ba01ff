"""Structured text (IEC 61131-3): the function block of a model, and the proof that it is the model."""

from discovery.export.st.block import st_name, st_text
from discovery.export.st.language import KINDS
from discovery.export.st.plcopen import plcopen_text
from discovery.export.st.proof import prove_st
from discovery.export.st.scl import scl_text

__all__ = ["KINDS", "plcopen_text", "prove_st", "scl_text", "st_name", "st_text"]
