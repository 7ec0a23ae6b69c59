# Works from any folder (make -C), as any user; needs make and Python 3.11 to 3.14 with venv, nothing else.
LAB ?= lab2_executors
SUBMISSIONS ?=
NB ?=
N ?= 20
PYTHON ?=
ARGS ?=

# nbgrader starts other programs of the environment by their bare name, so its folder leads the search path.
RUN := PATH="$(CURDIR)/.venv/bin:$$PATH"

# Any Python 3 starts the set-up, which then looks for one that will do, or says what is missing.
# Isolated, so that nothing of the shell's comes between; of the checkout it has to be told then.
define set_up
@BEGIN='import os, sys; sys.path.insert(0, os.getcwd()); from autograder.setup.bootstrap import main; sys.exit(main())'; \
for python in $(if $(PYTHON),"$(PYTHON)") python3 python3.14 python3.13 python3.12 python3.11; do \
  if "$$python" -I -c 'import sys; sys.exit(sys.version_info < (3, 6))' 2>/dev/null; then \
    exec "$$python" -I -c "$$BEGIN" --python "$(PYTHON)" $(1); fi; done; \
echo "No Python was found. The kit needs Python 3.11 to 3.14." >&2; \
echo "What to do: sudo apt-get install python3 python3-venv   or name one: make PYTHON=/path/to/python3.12" >&2; exit 2
endef

.PHONY: help setup setup-dev doctor grade check submit test test-all lint jupyter lectures pdf release wheel soak machines margins mutants bench lock clean distclean

help: ## this list
	@echo 'make TARGET [LAB=$(LAB)] [PYTHON=python3.12] [ARGS="more options"]'; echo
	@sed -n 's/^\([a-z-]*\):.*## \(.*\)/\1|\2/p' Makefile | while IFS='|' read -r name text; do \
	  printf '  %-10s %s\n' "$$name" "$$text"; done

setup: ## make .venv with what students and instructors need (every other target does it by itself)
	$(call set_up)

setup-dev:
	$(call set_up,--dev)

doctor: setup ## say what this machine offers, and what to do about what it lacks
	@$(RUN) autograder doctor $(ARGS)

grade: setup ## grade a class: the sample class, or SUBMISSIONS=folder-or-zip
	@$(if $(SUBMISSIONS),:,$(RUN) python tests/sample_class.py $(LAB) >/dev/null)
	@$(RUN) autograder grade $(LAB) $(if $(SUBMISSIONS),"$(SUBMISSIONS)") $(ARGS)

check: setup ## report on one notebook: NB=path/to/notebook.ipynb
	@$(RUN) autograder check "$(NB)" $(ARGS)

submit: setup ## copy one notebook to what is handed in, with a receipt: NB=path/to/notebook.ipynb
	@$(RUN) autograder submit "$(NB)" $(ARGS)

jupyter: setup ## open the labs in JupyterLab
	@$(RUN) autograder jupyter $(ARGS)

release: setup-dev ## make labs/ from solutions/, and from them build/release: what students get
	@$(RUN) autograder release $(ARGS)
	@$(RUN) autograder kit

lectures: setup-dev ## build the book and the slides into build/lectures
	@$(RUN) python lectures/_lib/build.py build/lectures $(ARGS)
	@echo build/lectures/book/index.html build/lectures/slides/index.html

pdf: lectures ## print the slides as PDF, a page for each, into build/lectures/slides (needs chromium)
	@$(RUN) python lectures/_lib/print_talks.py build/lectures/slides

wheel: setup-dev ## build the kit as a wheel, for courses elsewhere, into build/wheel
	@rm -rf build/lib build/wheel
	@$(RUN) uv build --quiet --wheel --no-build-isolation --out-dir build/wheel .
	@rm -rf build/lib build/bdist.* *.egg-info; ls build/wheel/*.whl

# Twice as many workers as two cores: most tests wait for messages rather than compute.
test: setup-dev ## run every test, ruff and mypy among them
	@$(RUN) python -m pytest -n 4 --dist loadfile --no-loadscope-reorder $(ARGS)

test-all: setup-dev ## the same, with every check run on every sample student, and every lab in a browser
	@$(RUN) python -m pytest -n 4 --dist loadfile --no-loadscope-reorder --complete $(ARGS)

lint: setup-dev ## ruff, its formatting, mypy --strict, and the direction of imports
	@$(RUN) ruff check .
	@$(RUN) ruff format --check .
	@$(RUN) mypy autograder
	@$(RUN) lint-imports --no-cache --no-logo

soak: setup-dev ## grade every sample student N=20 times, half of them under load: nothing may differ
	@$(RUN) python tests/soak.py --times $(N) $(if $(filter command line,$(origin LAB)),--lab $(LAB)) $(ARGS)

machines: setup-dev ## grade LAB's sample students with half and a quarter of a CPU, and beside 30 busy loops: nothing may differ
	@$(RUN) python tests/machines.py $(LAB) $(ARGS)

margins: setup-dev ## how far each bound on time in a check is from the sample students, on a quiet and on a busy machine
	@$(RUN) python tests/margins.py $(if $(filter command line,$(origin LAB)),--lab $(LAB)) $(ARGS)

mutants: setup-dev ## change LAB's solutions by rule, one change at a time, and grade each: what survives lacks a check
	@$(RUN) python tests/mutants.py $(LAB) $(ARGS)

bench: setup-dev ## measure this grader against stock nbgrader, and how it scales with jobs, classes and Dask
	@$(RUN) python tests/bench.py $(ARGS)
	@$(RUN) python tests/bench_scale.py

lock: setup-dev ## pin the newest versions of pyproject.toml's dependencies, with hashes
	@$(RUN) sh -euc 'compile="uv pip compile pyproject.toml --quiet --universal --python-version 3.11 --generate-hashes \
	  --no-emit-index-url --no-emit-find-links --no-annotate --no-header --upgrade"; \
	$$compile --extra lectures --extra dev -o requirements-dev.lock; \
	$$compile --constraint requirements-dev.lock -o requirements.lock'

clean: ## remove everything that was built
	rm -rf build

distclean: clean ## remove .venv too
	rm -rf .venv
