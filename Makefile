# The front door. Each rule first installs the Debian packages it needs, if any is missing.
#
#   make help                    what there is
#   make test PRESET=asan        any preset of CMakePresets.json
PRESET ?= release
PREFIX ?= /usr/local
JOBS ?= $(shell nproc)
BUILD = $(if $(filter release,$(PRESET)),build,build-$(PRESET))
PACKAGE_GROUPS = build $(if $(filter tsan clang fuzz,$(PRESET)),check)
MAKEFLAGS += --no-print-directory

# Configures and builds the targets $(2) of the preset $(1), whose folder is $(3).
build_targets = cmake --preset $(1) --log-level=NOTICE >/dev/null && \
	cmake --build $(3) --parallel $(JOBS) --target $(2)

.PHONY: help build demo test test-sanitized test-long torture fuzz mutants check-metrics check-mitsuba check-package check-same-bits python bench bench-peers gallery method-pictures compare-weights compare-defaults radius-sweep paper-000 paper-002 paper-003 paper-004 lint install package clean dependencies
help:
	@echo "make build      the program build/caustica and the libraries"
	@echo "make demo       renders the Cornell box and the caustics scene to out/"
	@echo "make test       every fast test           (PRESET=asan, tsan, debug: with that build)"
	@echo "make test-sanitized  the tests that stay fast with the address and undefined-behaviour sanitizers"
	@echo "make check-metrics  compare's SSIM and FLIP against other programs, from the Python package index"
	@echo "make check-same-bits  the same pictures, to the bit, from gcc and clang, -O1 and -O3, AVX2 and AVX-512"
	@echo "make check-mitsuba  the recorded images of tests/mitsuba against Mitsuba 3, from the Python package index"
	@echo "make check-package  the Debian package, installed and used in an empty Debian in build/package-root (as root)"
	@echo "make test-long  the slow, statistical tests"
	@echo "make torture    20 minutes of runs in which memory, files and threads fail (MINUTES=n)"
	@echo "make fuzz       the fuzzers of all readers, with sanitizers (HOURS=n, default 1; ONLY=name)"
	@echo "make mutants    deliberate bugs, and whether its test finds each (ONLY=pattern: those with such names)"
	@echo "make python     the wheel of the Python package, to build/python/; then make test tests it, too"
	@echo "make bench      measures speed, writes bench/results.json"
	@echo "make bench-peers  path against Mitsuba 3's in equal time, writes bench/peers.json (QUICK=1, ONLY=scene: print only)"
	@echo "make gallery    the pictures of docs/pictures/gallery/, and path beside them in equal time (QUICK=1: small, to out/)"
	@echo "make method-pictures  the pictures of docs/which-method.md (QUICK=1: small, to out/)"
	@echo "make compare-weights  noise of vavcm over that of other methods: the table of docs/decisions/018 (QUICK=1: print only)"
	@echo "make compare-defaults  their errors at default settings; make radius-sweep: those of other merge radii (print only)"
	@echo "make paper-000  paper 000's figures: the tables and pictures of docs/papers/000.md (QUICK=1: print only; FULL=1)"
	@echo "make paper-002  paper 002's comparison: the tables and close-ups of docs/papers/002.md (QUICK=1: print only; FULL=1)"
	@echo "make paper-003  paper 003's figures: the tables and pictures of docs/papers/003.md (QUICK=1: small, to out/)"
	@echo "make paper-004  paper 004's figures: the tables and plots of docs/papers/004.md (QUICK=1: print only; FULL=1)"
	@echo "make lint       source rules; the binary interface against the last release's; gcc and clang with warnings as errors; clang-tidy"
	@echo "make install    to PREFIX (default /usr/local); DESTDIR is honoured"
	@echo "make package    a Debian package of program and library, to build/package/"
	@echo "make clean      removes build folders and out/"

dependencies:
	@scripts/install-dependencies.sh $(PACKAGE_GROUPS)

build: dependencies
	@$(call build_targets,$(PRESET),all,$(BUILD))

demo: build
	@mkdir -p out
	$(BUILD)/caustica render scenes/cornell-box/cornell-box.xml -i auto --time 4 -o out/cornell-box.exr -o out/cornell-box.png
	$(BUILD)/caustica render scenes/caustics/caustics.xml -i auto --time 4 -o out/caustics.exr -o out/caustics.png
	@echo "The images are:"
	@ls -l out/cornell-box.exr out/cornell-box.png out/caustics.exr out/caustics.png

# MPI is in no build with sanitizers.
test: PACKAGE_GROUPS += $(if $(filter release,$(PRESET)),test)
test: dependencies
	@rm -f $(BUILD)/tests/summary
	@$(call build_targets,$(PRESET),all tests,$(BUILD))
	@scripts/run-tests.sh $(BUILD) tests

# The fast tests but those of tests/slow_sanitized.txt.
test-sanitized: dependencies
	@$(call build_targets,asan,all tests-sanitized,build-asan)
	@scripts/run-tests.sh build-asan tests-sanitized

test-long: dependencies
	@$(call build_targets,$(PRESET),all tests-long,$(BUILD))
	@CA_TEST_TIMEOUT=$${CA_TEST_TIMEOUT:-3600} scripts/run-tests.sh $(BUILD) tests-long

torture: dependencies
	@$(call build_targets,release,caustica test_torture,build)
	@cd $(CURDIR) && CA_TORTURE_MINUTES=$(or $(MINUTES),20) build/tests/test_torture

fuzz:
	@scripts/install-dependencies.sh build check
	@cmake --preset fuzz --log-level=NOTICE >/dev/null && cmake --build build-fuzz --parallel $(JOBS) --target fuzzers
	@scripts/fuzz.sh build-fuzz $(or $(HOURS),1) $(ONLY)

mutants: PACKAGE_GROUPS += mutants
mutants: dependencies
	@scripts/run-mutants.sh $(ONLY)

python: build
	@scripts/install-dependencies.sh python
	@scripts/make-python.sh $(BUILD)

check-metrics: build
	@scripts/install-dependencies.sh check
	@scripts/check-metrics.sh $(BUILD)

check-package: package
	@scripts/check-package.sh $(BUILD)/package-root

check-same-bits:
	@scripts/install-dependencies.sh build check
	@scripts/check-same-bits.sh

check-mitsuba:
	@scripts/install-dependencies.sh check
	@scripts/check-mitsuba.sh $(BUILD)

bench: dependencies
	@$(call build_targets,release,all benches,build)
	@scripts/run-benches.sh build

bench-peers: dependencies
	@[ -n "$$DRJIT_LIBLLVM_PATH" ] || scripts/install-dependencies.sh peers
	@$(call build_targets,release,caustica,build)
	@scripts/bench-peers.sh build $(if $(QUICK),--quick) $(if $(ONLY),--only $(ONLY))

gallery: dependencies
	@$(call build_targets,release,caustica,build)
	@scripts/gallery.sh build $(if $(QUICK),--quick out/gallery)

method-pictures: dependencies
	@$(call build_targets,release,caustica,build)
	@scripts/method-pictures.sh build $(if $(QUICK),--quick out/methods)

compare-weights: dependencies
	@$(call build_targets,release,all compare_weights,build)
	@scripts/compare-weights.sh build $(if $(QUICK),--quick)

compare-defaults: dependencies
	@$(call build_targets,release,all compare_defaults,build)
	@build/compare_defaults --iterations $(if $(QUICK),16,64)

radius-sweep: dependencies
	@$(call build_targets,release,all radius_sweep,build)
	@build/radius_sweep radii --side 32 --seeds $(if $(QUICK),1,3) --reference-iterations 512

PAPER_OPTIONS = $(if $(QUICK),--quick) $(if $(FULL),--full) $(if $(MINUTES),--minutes $(MINUTES))

paper-000: dependencies
	@$(call build_targets,release,all paper_000,build)
	@scripts/paper-figures.sh 000 build $(PAPER_OPTIONS)

paper-002: dependencies
	@$(call build_targets,release,all paper_002,build)
	@scripts/paper-figures.sh 002 build $(PAPER_OPTIONS)

paper-003: dependencies
	@$(call build_targets,release,caustica long_paper_003,build)
	@scripts/paper-003.sh build $(if $(QUICK),--quick)

paper-004: dependencies
	@$(call build_targets,release,all paper_004,build)
	@scripts/paper-004.sh build $(PAPER_OPTIONS)

lint:
	@scripts/install-dependencies.sh build check
	@scripts/check-sources.sh
	@scripts/check-abi.sh
	@echo "gcc, warnings as errors"
	@$(call build_targets,release,all tests tests-long bench-objects fuzz-objects,build)
	@echo "clang, warnings as errors"
	@$(call build_targets,clang,all tests tests-long benches fuzz-objects,build-clang)
	@echo "clang-tidy"
	@scripts/check-tidy.sh build-clang
	@echo "lint: no complaints"

install: build
	@cmake --install $(BUILD) --prefix $(PREFIX)

package: build
	@scripts/install-dependencies.sh package
	@cd $(BUILD) && cpack --config CPackConfig.cmake -B package >package.log || { cat package.log; exit 1; }
	@ls $(BUILD)/package/*.deb

clean:
	rm -rf build build-* out
