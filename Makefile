# make demo: set up and run the example part. make test: set up and pass the tests.
PYTHON ?= python3
BIN := .venv/bin

.PHONY: demo test lint docs bench pages pictures clean

demo: .venv/installed
	$(BIN)/python examples/turbine_blade.py -o out
	$(BIN)/parakin post out/turbine_blade.aptsource --machine tricept --target linuxcnc -o out

test: .venv/developing lint
	find src -name "*.nb[ci]" -delete  # Numba's cache does not see a change in a file that a kernel calls
	$(BIN)/python tests/compile_kernels.py  # once, and not in each of three processes
	$(BIN)/python -m pytest -n 3  # on two cores: LinuxCNC's runs wait for much of their time

lint: .venv/developing
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy

docs: .venv/developing
	$(BIN)/sphinx-build -W --keep-going -q -b html docs build/docs
	@echo "build/docs/index.html"

bench: .venv/developing
	$(BIN)/python benchmarks/run.py

pages: .venv/installed
	$(BIN)/python scripts/reading_page.py

pictures: .venv/developing
	$(BIN)/python examples/pictures.py -o docs/pictures
	$(BIN)/python examples/gallery.py -o docs
	$(BIN)/python examples/leg_figures.py -o docs/pictures/legs
	$(BIN)/python examples/page_pictures.py -o docs/pictures

.venv/installed: pyproject.toml
	$(PYTHON) -c "import sys; sys.exit('parakin needs Python 3.11 to 3.13, not ' + sys.version.split()[0]) if not (3, 11) <= sys.version_info[:2] <= (3, 13) else None"
	$(PYTHON) -m venv .venv
	$(BIN)/python -m pip install --quiet --upgrade pip
	$(BIN)/python -m pip install --quiet --editable .
	touch $@

.venv/developing: .venv/installed
	$(BIN)/python -m pip install --quiet --editable ".[dev]"
	touch $@

clean:
	rm -rf .venv out .mypy_cache .pytest_cache .ruff_cache .hypothesis
	find . -name __pycache__ -type d -prune -exec rm -rf {} +
