# Recipes use names relative to this directory only, and never the scripts that pip writes to .venv/bin,
# whose first line breaks when the path has a space or a quote in it.

PYTHON = .venv/bin/python
ARGS =
# Processes of tests: ARGS=-n0 runs them in one.
PARALLEL = -n auto --maxprocesses 4 --dist worksteal

.DEFAULT_GOAL = help
.PHONY: help study test test-long test-faults calibration docs lint setup lock release clean

help:  ## list the targets
	@echo 'Targets (each first installs what it needs; ARGS="..." goes to the program or to pytest):'
	@awk -F ':.*## ' '/^[a-z-]+:.*## /{printf "  make %-11s %s\n", $$1, $$2}' Makefile

study: setup  ## run the study
	$(PYTHON) -m orchestrator study $(ARGS)

test: lint  ## lint, then run the tests, but for those that take long
	SKIP_NOTHING=1 $(PYTHON) -m pytest $(PARALLEL) -m "not long" --ignore=tests/faults $(ARGS)

test-long: lint  ## run the tests that install, queue, or run whole studies: minutes
	SKIP_NOTHING=1 $(PYTHON) -m pytest $(PARALLEL) -m long --ignore=tests/faults $(ARGS)

test-faults: lint  ## kill, harm and starve a small study, and count what it survives: minutes
	$(PYTHON) -m pytest $(PARALLEL) tests/faults $(ARGS)

calibration: setup  ## measure numerical errors, maps and intervals anew, for the package and its docs
	$(PYTHON) -m orchestrator ladder
	$(PYTHON) -m orchestrator stability
	$(PYTHON) -m orchestrator budget
	$(PYTHON) -m orchestrator validate
	cp results/stability/tables/maps.csv orchestrator/fidelity/calibration/
	$(PYTHON) -m orchestrator study paper
	$(PYTHON) tools/random_piles.py dem > results/random.toml
	$(PYTHON) -m orchestrator study results/random.toml
	$(PYTHON) tools/random_piles.py peeling > results/meshes.toml
	$(PYTHON) -m orchestrator ladder results/meshes.toml --out results/meshes
	$(PYTHON) tools/beside_dem.py results/paper results/random > beside.csv
	$(PYTHON) tools/calibration.py results/ladder/tables/scene_errors.csv results/meshes/tables/scene_errors.csv beside.csv
	rm beside.csv
	$(PYTHON) tools/domain.py > domain.csv
	mv domain.csv orchestrator/fidelity/calibration/
	cp results/budget/tables/budget.csv orchestrator/fidelity/calibration/
	$(PYTHON) tools/tested.py > tested.csv
	mv tested.csv orchestrator/physics/tested.csv
	$(PYTHON) tools/tested.py results/validate/tables/measured.csv > tested.csv
	mv tested.csv orchestrator/physics/tested_strips.csv
	$(PYTHON) tools/usable.py results/usable > usable.csv
	mv usable.csv docs/measured/usable.csv
	$(PYTHON) tools/errors.py
	$(PYTHON) tools/maps.py
	$(PYTHON) tools/budget.py results/budget/tables/shares.csv
	cp results/stability/figures/maps.png docs/stability.png

docs:  ## make the site of the documents, site/README.html, which reads offline
	@sh tools/setup.sh docs
	$(PYTHON) -m sphinx -q -W --keep-going -c docs . site

lint:  ## ruff and mypy
	@sh tools/setup.sh test
	$(PYTHON) -m ruff check .
	$(PYTHON) -m ruff format --check .
	$(PYTHON) -m mypy

setup:  ## install all that the study needs: Debian packages (as root or by sudo) and .venv
	@sh tools/setup.sh run

lock:  ## pin anew, from pyproject.toml, what goes into .venv
	@sh tools/setup.sh lock

release:  ## build wheel and sdist, and try each in an empty environment
	@sh tools/setup.sh test
	@sh tools/release.sh

clean:  ## remove .venv, caches and built packages; results stay
	rm -rf site .venv .mypy_cache .pytest_cache .ruff_cache .hypothesis dist
	find orchestrator tests -type d -name __pycache__ -prune -exec rm -rf {} +
