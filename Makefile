# The verbs of Mouthpiece; `make help` lists them. Everything made lands in build/.
SHELL := /bin/sh
JOBS ?= $(shell nproc)
PREFIX ?= /usr/local
FUZZ_SECONDS ?= 60
SHARE := build/share/mouthpiece
SAMPLE_TAKES := build/sample_takes
CLOCK_TAKES := build/clock_takes
DEMO_OUT := build/demo
DEMO_SONG := build/demo_song
CANONICAL_FACE := build/third_party/canonical_face.obj

.PHONY: help setup setup-test build build-tests data demo test bench lint format fuzz quick nightly faults coverage \
  mutation load processors wasm portable sbom reproducible clean install uninstall deb
help:
	@echo "make setup    install the packages it needs (asks for sudo when not root)"
	@echo "make build    build the programs into build/bin"
	@echo "make demo     install, build, perform the sample corpus, speak a first line"
	@echo "make test     install, build, run every test"
	@echo "make bench    benchmarks        make fuzz    fuzz the readers ($(FUZZ_SECONDS) s each)"
	@echo "make quick    sanitizers and fuzzing for what changed against BASE (origin/main)"
	@echo "make nightly  all that takes hours; a part alone: make faults coverage mutation load processors"
	@echo "make wasm     what moves a face as WebAssembly: synth --page-engine puts it into view.html"
	@echo "make portable the same core with clang and libc++, and its unit tests"
	@echo "make sbom     packages, versions, licences as SPDX    make reproducible  two builds, the same bytes"
	@echo "make lint     clang-format and clang-tidy    make format    rewrite with clang-format"
	@echo "make deb      a Debian package with programs, sample corpus and face: build/*.deb"
	@echo "make install  into PREFIX=$(PREFIX)          make uninstall takes away what that wrote"
	@echo "make clean    remove build folders"

setup:
	@tools/setup.sh
setup-test:
	@tools/setup.sh test wasm

# The programs and the page alone; `make test` adds the tests and looks again for what has been installed since.
configure = cmake --preset release -DMOUTHPIECE_TESTS=$(1) -DMOUTHPIECE_UNITY=ON >build.configure.log 2>&1 || \
	{ tail -n 20 build.configure.log >&2; rm -f build.configure.log; exit 1; }; rm -f build.configure.log
build/build.ninja: CMakePresets.json
	@$(call configure,OFF)
build: setup build/build.ninja
	@cmake --build build -j $(JOBS) --target programs

# What synth speaks with when it is told nothing else. Made again when the program that makes it has changed.
# MediaPipe's (468 vertices, Apache-2.0, (c) The MediaPipe Authors).
$(CANONICAL_FACE): tools/fetch_packed.sh
	@tools/fetch_packed.sh mind-ar@1.2.5 e14a0f6e1bdd85beb757d72354999a967efcaaac2fc9a036ce1852ea2d6c5193 $(@D) \
	  src/face-target/face-geometry/canonical-face-model.obj:$(@F)
	@touch $@
$(SHARE)/sample.corpus: build/bin/corpus
	@build/bin/corpus sample $(SAMPLE_TAKES) --prompts rich
	@build/bin/corpus build $(SAMPLE_TAKES) --out $@
# The paper's sentences alone: `synth --corpus clock`.
$(SHARE)/clock.corpus: build/bin/corpus
	@build/bin/corpus sample $(CLOCK_TAKES) --prompts clock
	@build/bin/corpus build $(CLOCK_TAKES) --out $@
$(SHARE)/default.face: build/bin/retarget $(SHARE)/clock.corpus $(CANONICAL_FACE)
	@build/bin/retarget sample --out $(SHARE) --canonical $(CANONICAL_FACE) --corpus $(SHARE)/clock.corpus
data: build
	@$(MAKE) --no-print-directory -j $(JOBS) $(SHARE)/sample.corpus $(SHARE)/clock.corpus $(SHARE)/default.face

demo: data
	@build/bin/synth --text "the time is now" --out $(DEMO_OUT)
	@build/bin/synth --song sample_data/songs/twinkle.json --out $(DEMO_SONG)
	@echo
	@echo "The page   $(CURDIR)/$(DEMO_OUT)/view.html   (open it in a browser)"
	@echo "The face   $(CURDIR)/$(DEMO_OUT)/face.glb"
	@echo "The sound  $(CURDIR)/$(DEMO_OUT)/speech.wav"
	@echo "A song     $(CURDIR)/$(DEMO_SONG)/view.html"

# The ends of what failed tests printed, once more and last, where they are seen.
say_failures = awk '/ Testing: /{n=0} {line[n++]=$$0} /^Test (Failed|[Tt]imeout|not)/{for(i=n>40?n-40:0;i<n;++i) print line[i]}' \
	build/Testing/Temporary/LastTest.log | tail -n 120 >&2
build-tests: setup-test
	@$(call configure,ON)
	@cmake --build build -j $(JOBS)
test: build-tests data wasm
	@ctest --preset release -j $(JOBS) || { $(say_failures); exit 1; }

bench: data
	@tools/setup.sh bench
	@cmake --preset bench >/dev/null && cmake --build build-bench -j $(JOBS) --target benchmarks
	@tests/bench/table.py --benches build-bench/benchmarks --bin build/bin

lint:
	@tools/setup.sh lint
	@tools/lint.sh
format:
	@tools/setup.sh lint
	@git ls-files '*.h' '*.cpp' | xargs clang-format -i
fuzz: setup
	@tools/setup.sh test lint
	@tools/fuzz.sh $(FUZZ_SECONDS)

# tools/nightly.sh says what its parts are and which variables set how long they take.
quick: build
	@tools/setup.sh test lint
	@tools/quick.sh
nightly: data
	@tools/setup.sh nightly bench portable
	@tools/nightly.sh $(PARTS)
faults load: data
	@cmake --build build -j $(JOBS) --target faults load_trial
	@tools/nightly.sh $@
coverage mutation: data
	@tools/setup.sh nightly
	@tools/nightly.sh $@; cat build-nightly/$@.log
processors: setup
	@tools/setup.sh processors
	@tools/other_processors.sh s390x armhf arm64
# The programs find the engine beside their other data.
wasm: setup
	@tools/setup.sh wasm
	@cmake --preset wasm >/dev/null && cmake --build build-wasm -j $(JOBS)
	@mkdir -p $(SHARE) && cp build-wasm/bin/page_engine.wasm $(SHARE)/page_engine.wasm
portable: setup
	@tools/setup.sh portable
	@cmake --preset portable >/dev/null && cmake --build build-portable -j $(JOBS)
	@ctest --preset portable
sbom: build
	@tools/sbom.py --out build/mouthpiece.spdx.json
reproducible: setup
	@tools/reproducible.sh

install: data
	@cmake --build build -j $(JOBS) --target mouthpiece_shared mouthpiece_static
	@if [ -w "$(PREFIX)" ] || { [ ! -e "$(PREFIX)" ] && mkdir -p "$(PREFIX)" 2>/dev/null; }; \
	then cmake --install build --prefix "$(PREFIX)" >/dev/null; \
	else sudo cmake --install build --prefix "$(PREFIX)" >/dev/null; fi
	@echo "Installed synth, corpus and retarget into $(PREFIX)/bin"

uninstall:
	@if [ -w "$(PREFIX)" ]; then cmake -DMANIFEST=build/install_manifest.txt -P cmake/Uninstall.cmake; \
	else sudo cmake -DMANIFEST=build/install_manifest.txt -P cmake/Uninstall.cmake; fi

deb: data
	@cmake --build build -j $(JOBS) --target command_docs >/dev/null
	@cd build && cpack -G DEB --config CPackConfig.cmake >cpack.log 2>&1 || { tail -n 20 cpack.log >&2; exit 1; }
	@ls build/mouthpiece_*.deb
clean:
	@rm -rf build build-*
