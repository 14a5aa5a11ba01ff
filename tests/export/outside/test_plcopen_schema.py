"""PLCopen XML by the schema that PLCopen published."""

from __future__ import annotations

from discovery.export.st import plcopen_text
from tests.export.conftest import make_campaign, make_model
from tests.export.outside.conftest import SCHEMA
from tests.export.test_guarded_c import sealed


def test_the_xml_is_valid_by_the_schema_of_plcopen() -> None:
    import xmlschema

    schema = xmlschema.XMLSchema(str(SCHEMA))
    for precision in ("double", "float"):
        text = plcopen_text(sealed(make_model(), make_campaign()), precision)
        assert [str(error) for error in schema.iter_errors(text)] == []
