# Everything runs in virtual environments that packaging/venv.sh makes on demand; nothing to prepare but
# make and Python 3.11 (or 3.13). `make help` lists what there is.
PYTEST = -P -m pytest
TRAINED = .venv-training/bin/python -m beyond_mocap
WEIGHTS = beyond_mocap/throws/networks/weights
REAL_BLENDER ?= ../shared/tools/real-blender

.DEFAULT_GOAL := help
.NOTPARALLEL:
# Python keeps what it compiles, whatever the caller says: processes that tests start would compile the core each time,
# and every run all tests, whose assertions pytest rewrites.
unexport PYTHONDONTWRITEBYTECODE
.PHONY: help venv venv-oldest training lint quick test test-core test-blender test-rooms test-operators test-oldest test-training left-out \
  demo bench weights experiments tables docs package extension extension-all repository repository-test pins window-test window-bench \
  fuzz kill-test pictures clean

help:
	@echo 'make venv           .venv with Blender as a Python module and all that the tests need'
	@echo 'make training       .venv-training with what trains the networks of throws and kicks (jax, no Blender)'
	@echo 'make quick ROOM=... the tests of one package (ROOM=path_editing), in about a minute'
	@echo 'make lint           ruff over all source, mypy over the core, the workflow by its schema'
	@echo 'make test           all tests but the window ones: the core, training, then Blender 5.0 (or 5.2) and Blender 4.5'
	@echo 'make test-oldest    all tests of Blender in 4.5, where `make test` leaves out some'
	@echo 'make left-out       choose again which tests the older Blender leaves out, by the lines that they reach'
	@echo 'make fuzz           damaged files for every reader and verb, for 10 minutes on two cores (SECONDS_OF_FUZZ=600)'
	@echo 'make kill-test      library builds, matches, bodies and trainings killed at 100 random moments, and resumed'
	@echo 'make demo           the sample match, synthesized and rendered into build/demo'
	@echo 'make bench          time and quality on recordings'
	@echo 'make weights        fit the shipped linear starts again to synthetic throws and kicks; some minutes'
	@echo 'make experiments    networks of full size on recorded kicks, for HOURS=8, into OUT=build/experiments; repeated, it continues'
	@echo 'make tables         the pages of docs/ that come from the code: settings, commands, labels, providers'
	@echo 'make docs           the documents as a site, into build/docs; broken links are errors'
	@echo 'make package        the Python package, wheel and source archive, into build/package'
	@echo 'make extension      the zips for Blender, one for each of its Pythons, into build/extension;'
	@echo '                    PLATFORMS="windows-x64 macos-arm64" for others, MAINTAINER="Name <mail>" to publish them'
	@echo 'make extension-all  the zips of all platforms: linux-x64 windows-x64 macos-arm64 macos-x64'
	@echo 'make repository     a static extension repository of the zips that stand in build/extension, into build/repository'
	@echo 'make repository-test  a repository over http on this machine: Blenders install 0.1.0 from it and update'
	@echo 'make pins           resolve and pin the wheels of the zips again, with their hashes'
	@echo 'make window-test    install the zip in a real Blender and press its buttons; skipped where none can be had'
	@echo 'make window-bench   the same, and times in the window that are above their targets are failures'
	@echo 'make pictures       the pictures of docs/, taken in a real Blender of our own sample'
	@echo 'make clean          remove build/ and the links to the virtual environments'

venv:
	@packaging/venv.sh main

venv-oldest:
	@packaging/venv.sh oldest

training:
	@packaging/venv.sh training

# Two processes at any time, so that no core idles and none is shared: the core's tests by two, then training and
# Blender's beside the older Blender and the matrix of operators, which are shown when they are done. Linear algebra
# takes no threads of its own: they would wait for the other's. Where there are two Blenders, each tries half of all
# pairs of an operator and an awkward situation, and the older one leaves out slow tests that reach nothing new.
MATRIX = test_every_operator.py::test_in_an_awkward_situation_it_works_or_says_what_to_do
test test-core test-blender test-rooms test-operators test-oldest: export OPENBLAS_NUM_THREADS = 1
test test-core test-blender test-rooms test-operators test-oldest: export OMP_NUM_THREADS = 1
test: venv venv-oldest training
	@rm -rf build/test-cache; mkdir -p build; status=0; if [ -e .venv-4.5 ]; then export BLENDERS_IN_TURN=1; fi; \
	export TESTS_CACHE="$$PWD/build/test-cache"; \
	$(MAKE) -s test-core || status=1; \
	$(MAKE) -s -k test-oldest test-operators >build/test-beside.txt 2>&1 & second=$$!; \
	$(MAKE) -s -k test-training test-rooms || status=1; wait $$second || status=1; cat build/test-beside.txt; exit $$status

lint: venv
	@packaging/venv.sh lint
	.venv-lint/bin/ruff check .
	.venv-lint/bin/mypy --python-executable .venv/bin/python
	.venv-lint/bin/check-jsonschema --builtin-schema vendor.github-workflows .github/workflows/*.yml

# One room's folders, tests/core/ROOM and tests/blender/ROOM, and files, test_ROOM*.py; the second has settings of its own.
ROOM_OF = $(wildcard tests/$(1)/$(ROOM) tests/$(1)/*/$(ROOM) tests/$(1)/test_$(ROOM).py tests/$(1)/test_$(ROOM)_*.py)
ROOMS = $(sort $(filter-out __pycache__,$(notdir $(patsubst %/,%,$(wildcard tests/core/*/ tests/blender/*/))) \
  $(patsubst test_%.py,%,$(notdir $(wildcard tests/core/test_*.py tests/blender/test_*.py)))))
quick: export OPENBLAS_NUM_THREADS = 1
quick: export OMP_NUM_THREADS = 1
quick: venv
	@if [ -z "$(ROOM)" ] || [ -z "$(strip $(call ROOM_OF,core)$(call ROOM_OF,blender))" ]; then \
	  echo "make quick: no room '$(ROOM)'; ROOM is one of: $(ROOMS)"; exit 2; \
	fi; status=0; \
	for found in "$(strip $(call ROOM_OF,core))" "$(strip $(call ROOM_OF,blender))"; do \
	  [ -z "$$found" ] || .venv/bin/python $(PYTEST) -q $$found || status=1; \
	done; exit $$status

test-core: venv
	.venv/bin/python $(PYTEST) -n 2 --dist loadgroup tests/core tests/packaging

test-training: training
	.venv-training/bin/python $(PYTEST) tests/training

test-blender: test-rooms test-operators

test-rooms: venv
	.venv/bin/python $(PYTEST) tests/blender --deselect $(MATRIX)

test-operators: venv
	.venv/bin/python $(PYTEST) tests/blender/$(MATRIX)

test-oldest: venv-oldest
	@if [ -e .venv-4.5 ]; then set -x; .venv-4.5/bin/python $(PYTEST) tests/blender; fi

# What the older Blender leaves out in `make test`, chosen again by what each test reaches: some 15 minutes.
left-out: export BLENDERS_IN_TURN = 1
left-out: venv-oldest
	.venv-4.5/bin/python -m pip install --quiet --disable-pip-version-check --target build/coverage \
	  -r packaging/requirements/coverage.txt
	PYTHONPATH=build/coverage:tests/blender .venv-4.5/bin/python $(PYTEST) -p choose_left_out tests/blender

# Not parts of `make test`: they last, and take other inputs each time. What they find is told with the number that makes it again.
SECONDS_OF_FUZZ ?= 600
fuzz kill-test: export OPENBLAS_NUM_THREADS = 1
fuzz kill-test: export OMP_NUM_THREADS = 1
fuzz: venv
	.venv/bin/python $(PYTEST) -q tests/fuzz
	.venv/bin/python -P tests/fuzz/fuzz.py --seconds $(SECONDS_OF_FUZZ)

kill-test: venv training
	.venv/bin/python -P tests/fuzz/kill.py

demo: venv
	.venv/bin/python sample_blend/demo.py --out build/demo

bench: venv
	.venv/bin/python -m benchmarks

# One thread: more add up in another order, and the files would differ in the signs of zeros.
weights: export OPENBLAS_NUM_THREADS = 1
weights: training
	@rm -rf build/examples
	@set -ex; for action in throw kick; do \
	  $(TRAINED) throw examples --out build/examples/$$action --action $$action --seed 0; \
	  $(TRAINED) throw train build/examples/$$action --action $$action --half --config training/synthetic.json --out build/examples/$$action.npz; \
	  mv build/examples/$$action.npz $(WEIGHTS)/$$action.npz; \
	done

# Not a part of `make test`: hours. Repeated, it continues; ROWS="name name" runs these alone, beside another if you like.
HOURS ?= 8
OUT ?= build/experiments
DATA ?= ../shared/data/mocap
ROWS ?=
experiments: export OPENBLAS_NUM_THREADS = 1
experiments: export OMP_NUM_THREADS = 1
experiments: training
	.venv-training/bin/python -m training.experiments --data $(DATA) --out $(OUT) --hours $(HOURS) $(ROWS:%=--row %)

tables: venv
	.venv/bin/python packaging/pages.py

docs: venv
	@packaging/venv.sh docs
	.venv-docs/bin/mkdocs build --quiet --strict
	@echo 'the documents stand in build/docs/index.html'

package:
	@packaging/venv.sh package
	rm -rf build/package
	.venv-package/bin/python -m build --no-isolation --outdir build/package .

extension: venv
	@packaging/venv.sh pack
	.venv/bin/python packaging/build.py $(if $(PLATFORMS),--platforms $(PLATFORMS)) $(if $(MAINTAINER),--maintainer "$(MAINTAINER)")

extension-all: PLATFORMS = linux-x64 windows-x64 macos-arm64 macos-x64
extension-all: extension

repository:
	@ls build/extension/*.zip >/dev/null 2>&1 || $(MAKE) -s extension
	.venv/bin/python packaging/repository.py

# What `make extension` has built is what is installed.
repository-test: venv-oldest
	@ls build/extension/*.zip >/dev/null 2>&1 || $(MAKE) -s extension
	REAL_BLENDER=$(REAL_BLENDER) .venv/bin/python $(PYTEST) tests/repository

# Older versions than these are kept where they still fit; `make pins UPGRADE=--upgrade` takes the newest.
pins:
	@packaging/venv.sh pack
	cd packaging/requirements && ../../.venv-pack/bin/uv pip compile --python-version 3.11 --python-platform linux --generate-hashes \
	  --only-binary :all: --no-emit-package numpy --no-annotate --no-header --quiet $(UPGRADE) bundle.in -o bundle.txt

window-test: extension
	@tests/gui/run $(REAL_BLENDER)

window-bench: extension
	@SPEED=--speed tests/gui/run $(REAL_BLENDER)

pictures: extension
	@tests/gui/run $(REAL_BLENDER) tests/gui/pictures.py

clean:
	rm -rf build .venv .venv-4.5 .venv-training .venv-lint .venv-docs .venv-package .venv-pack
