# Works from any folder (make -C) and for any user; needs only make and Python 3.11 to 3.14 with venv.
LAB ?= lab2_executors
SUBMISSIONS ?=
NB ?=
N ?= 20
USERS ?= 30
PYTHON ?=
ARGS ?=

# nbgrader starts other programs of the environment by their bare name, so the search path begins with its folder.
RUN := PATH="$(CURDIR)/.venv/bin:$$PATH"

# Any Python 3 can start the set-up, which then looks for a suitable Python, or says what is missing.
# It runs isolated (-I), so that no setting of the shell disturbs it; therefore it has to be told where the checkout is.
define set_up
@BEGIN='import os, sys; sys.path.insert(0, os.getcwd()); from autograder.setup.bootstrap import main; sys.exit(main())'; \
for python in $(if $(PYTHON),"$(PYTHON)") python3 python3.14 python3.13 python3.12 python3.11; do \
  if "$$python" -I -c 'import sys; sys.exit(sys.version_info < (3, 6))' 2>/dev/null; then \
    exec "$$python" -I -c "$$BEGIN" --python "$(PYTHON)" $(1); fi; done; \
echo "No Python was found. The kit needs Python 3.11 to 3.14." >&2; \
echo "What to do: sudo apt-get install python3 python3-venv   or name one: make PYTHON=/path/to/python3.12" >&2; exit 2
endef

.PHONY: help setup setup-dev doctor grade check submit test test-all lint jupyter lectures pdf release wheel soak machines margins mutants bank hub kilted bench lock clean distclean

help: ## show this list
	@echo 'make TARGET [LAB=$(LAB)] [PYTHON=python3.12] [ARGS="more options"]'; echo
	@sed -n 's/^\([a-z-]*\):.*## \(.*\)/\1|\2/p' Makefile | while IFS='|' read -r name text; do \
	  printf '  %-10s %s\n' "$$name" "$$text"; done

setup: ## create .venv with what students and instructors need (every other target does this by itself)
	$(call set_up)

setup-dev:
	$(call set_up,--dev)

doctor: setup ## say what this machine offers, and what to do if something is missing
	@$(RUN) autograder doctor $(ARGS)

grade: setup ## grade a class: the sample class, or SUBMISSIONS=folder-or-zip
	@$(if $(SUBMISSIONS),:,$(RUN) python tests/support/sample_class.py $(LAB) >/dev/null)
	@$(RUN) autograder grade $(LAB) $(if $(SUBMISSIONS),"$(SUBMISSIONS)") $(ARGS)

check: setup ## check one notebook and print a report: NB=path/to/notebook.ipynb
	@$(RUN) autograder check "$(NB)" $(ARGS)

submit: setup ## copy one notebook to handed_in, and print a receipt: NB=path/to/notebook.ipynb
	@$(RUN) autograder submit "$(NB)" $(ARGS)

jupyter: setup ## open the labs in JupyterLab
	@$(RUN) autograder jupyter $(ARGS)

release: setup-dev ## make labs/ from solutions/, and build/release with what students get
	@$(RUN) autograder release $(ARGS)
	@$(RUN) autograder kit

lectures: setup-dev ## build the book and the slides into build/lectures
	@$(RUN) python lectures/_lib/build.py build/lectures $(ARGS)
	@echo build/lectures/book/index.html build/lectures/slides/index.html

pdf: lectures ## print the slides as PDF, without and with the notes, into build/lectures/slides (needs chromium)
	@$(RUN) python lectures/_lib/print_talks.py build/lectures/slides

wheel: setup-dev ## build the kit as a wheel, for courses elsewhere, into build/wheel
	@rm -rf build/lib build/wheel
	@$(RUN) uv build --quiet --wheel --no-build-isolation --out-dir build/wheel .
	@rm -rf build/lib build/bdist.* *.egg-info; ls build/wheel/*.whl

# Twice as many workers as two cores: most tests wait for messages rather than compute.
test: setup-dev ## run every test, including ruff and mypy
	@$(RUN) python -m pytest -n 4 --dist loadfile --no-loadscope-reorder $(ARGS)

test-all: setup-dev ## run every test, every check on every sample student, every lab in a browser, and a real JupyterHub
	@$(RUN) python -m pytest -n 4 --dist loadfile --no-loadscope-reorder --complete $(ARGS)

lint: setup-dev ## check the code with ruff, its formatter, mypy --strict and import-linter
	@$(RUN) ruff check .
	@$(RUN) ruff format --check .
	@$(RUN) mypy autograder
	@$(RUN) lint-imports --no-cache --no-logo

soak: setup-dev ## grade every sample student N=20 times, half of them under load; no score may differ
	@$(RUN) python tests/tools/soak.py --times $(N) $(if $(filter command line,$(origin LAB)),--lab $(LAB)) $(ARGS)

machines: setup-dev ## grade LAB's sample students with half and a quarter of a CPU, and beside 30 busy loops; no verdict may differ
	@$(RUN) python tests/tools/machines.py $(LAB) $(ARGS)

margins: setup-dev ## say how far each bound on time in a check is from the sample students, on a quiet and on a busy machine
	@$(RUN) python tests/tools/margins.py $(if $(filter command line,$(origin LAB)),--lab $(LAB)) $(ARGS)

mutants: setup-dev ## change LAB's solution by rule, one change at a time, and grade each; a change that keeps its points may lack a check
	@$(RUN) python tests/tools/mutants.py $(LAB) $(ARGS)

bank: setup-dev ## run today's checks on the answers of past terms (folder bank), and list every difference
	@$(RUN) autograder bank check $(if $(filter command line,$(origin LAB)),$(LAB)) $(ARGS)

hub: setup-dev ## take USERS=30 students at once through a lab on a real JupyterHub, and print a table (as root)
	@$(RUN) python tests/tools/whole_class.py --users $(USERS) $(ARGS)

kilted: setup-dev ## run the book's measured statements and the labs' solutions on ROS 2 Kilted, and print what differs
	@$(RUN) python tests/tools/kilted.py $(ARGS)

bench: setup-dev ## measure what grading costs, against stock nbgrader and by size; ARGS=--short, ARGS="--many 10000"
	@$(RUN) python tests/tools/bench.py $(ARGS)

lock: setup-dev ## pin the newest versions of pyproject.toml's dependencies, with hashes
	@$(RUN) sh -euc 'compile="uv pip compile pyproject.toml --quiet --universal --python-version 3.11 --generate-hashes \
	  --no-emit-index-url --no-emit-find-links --no-annotate --no-header --upgrade"; \
	$$compile --extra lectures --extra dev -o requirements-dev.lock; \
	$$compile --constraint requirements-dev.lock -o requirements.lock'

clean: ## remove everything that was built
	rm -rf build

distclean: clean ## remove .venv as well
	rm -rf .venv
