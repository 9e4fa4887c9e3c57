# periFoam: peridynamics in C (pd_solver), coupled to OpenFOAM's solvers (foam_adapter).
#
# GNU make, run from this folder. `make help` lists the targets. Every variable can be given
# on the command line: make CC=mpicc.mpich OPTIMISE=-O0 WERROR=
# V=1 shows whole commands.

.DELETE_ON_ERROR:
.SUFFIXES:
MAKEFLAGS += --no-builtin-rules

.PHONY: all library adapter applications bootstrap pictures try-pictures test demo tutorials validate chart \
        stability bench bench-programs bench-tools unit-programs parallel-programs sanitize \
        faults fuzz-reader install dist format check-format clean distclean help force
all: library adapter applications

# --- sources ----------------------------------------------------------------------------

PD_SOURCES = \
    pd_solver/src/body.c \
    pd_solver/src/neighbourhood.c \
    pd_solver/src/halo.c \
    pd_solver/src/ghosts.c \
    pd_solver/src/lattice.c \
    pd_solver/src/lanes.c \
    pd_solver/src/material.c \
    pd_solver/src/material_hyperelastic.c \
    pd_solver/src/material_elastic.c \
    pd_solver/src/material_rate.c \
    pd_solver/src/force_bond.c \
    pd_solver/src/force_correspondence.c \
    pd_solver/src/force_bond_associated.c \
    pd_solver/src/formulation.c \
    pd_solver/src/damage.c \
    pd_solver/src/step.c \
    pd_solver/src/relaxation.c \
    pd_solver/src/smooth.c \
    pd_solver/src/partition.c \
    pd_solver/src/checksum.c \
    pd_solver/src/collective.c \
    pd_solver/src/hdf5_file.c \
    pd_solver/src/rows.c \
    pd_solver/src/checkpoint.c \
    pd_solver/src/output.c \
    pd_solver/src/status.c

# Compiled once for each instruction set; the running machine chooses.
PD_KERNELS = \
    pd_solver/src/lattice_bond.c \
    pd_solver/src/lattice_correspondence.c

ADAPTER_SOURCES = \
    foam_adapter/peridynamics/peridynamics.C \
    foam_adapter/momentumSource/momentumSource.C \
    foam_adapter/timeLevel/timeLevel.C \
    foam_adapter/solidTerms/solidTerms.C \
    foam_adapter/partitioned/partitioned.C \
    foam_adapter/gasMirror/gasMirror.C \
    foam_adapter/transfer/transfer.C \
    foam_adapter/transfer/stencils.C \
    foam_adapter/transfer/hosting.C \
    foam_adapter/transfer/locator.C \
    foam_adapter/transfer/sampleExchange.C \
    foam_adapter/transfer/halo.C \
    foam_adapter/transfer/exchange.C \
    foam_adapter/transfer/kernel.C \
    foam_adapter/solidBody/solidBody.C \
    foam_adapter/solidBody/readBody.C \
    foam_adapter/solidBody/moveBody.C \
    foam_adapter/motion/motion.C \
    foam_adapter/scene/scene.C \
    foam_adapter/checkpoints/checkpoints.C \
    foam_adapter/report/report.C \
    foam_adapter/bodyFields/bodyFields.C \
    foam_adapter/solidRun/solidRun.C \
    foam_adapter/decomposition/bodyCloud.C \
    foam_adapter/decomposition/periFoamDecomp.C \
    foam_adapter/checkedDictionary/checkedDictionary.C

# One program each, tests/unit/<name>.c.
UNIT_TESTS = \
    test_neighbourhood \
    test_partition \
    test_formulations \
    test_bond_associated \
    test_elementary \
    test_zero_energy \
    test_material \
    test_rate_material \
    test_damage \
    test_bond \
    test_lattice \
    test_body \
    test_step \
    test_relaxation \
    test_files \
    test_checkpoint \
    test_picture \
    test_traps

# One program each, tests/parallel/<name>.c, run on several ranks.
PARALLEL_TESTS = \
    test_bodies \
    test_checkpoint \
    test_files

# One program each, pd_solver/bench/<name>.c.
BENCHES = \
    bench_forces \
    bench_files \
    bench_ranks \
    bench_machine

# --- OpenFOAM ---------------------------------------------------------------------------

# FOAM_SRC, FOAM_LIB, FOAM_API and FOAM_FLAGS are scripts/bootstrap's. Make builds the file
# if a target needs it, also after another OpenFOAM environment has been sourced.
without_foam := library unit-programs parallel-programs sanitize bootstrap pictures bench \
    bench-programs bench-tools fuzz-reader format \
    check-format clean distclean help
ifneq ($(filter-out $(without_foam),$(or $(MAKECMDGOALS),all)),)
include .cache/openfoam.mk
ifneq ($(FOAM_ENVIRONMENT),$(or $(WM_PROJECT_DIR),/usr/share/openfoam):$(WM_OPTIONS))
.cache/openfoam.mk: force
endif
endif

.cache/openfoam.mk: scripts/bootstrap
	@scripts/bootstrap build
	@touch $@

# --- tools and flags --------------------------------------------------------------------

ifeq ($(origin CC),default)
CC = mpicc
endif
ifeq ($(origin CXX),default)
CXX = g++
endif
AR = ar

OPTIMISE = -O3
WERROR = -Werror
WARNINGS = -Wall -Wextra $(WERROR)
DEPENDENCIES = -MMD -MP

# <word>: shows it and the target in place of the command that follows.
brief = $(if $(V),,@printf '%-4s %s\n' $(1) $@; )

# Parallel HDF5. pkg-config of Debian knows hdf5-openmpi, others a plain hdf5.
HDF5_PACKAGE := $(firstword $(foreach p,hdf5-openmpi hdf5-mpi hdf5, \
    $(shell pkg-config --exists $(p) 2>/dev/null && echo $(p))))
HDF5_COMPILE := $(patsubst -I%,-isystem %,$(or $(shell \
    pkg-config --cflags-only-I $(HDF5_PACKAGE) 2>/dev/null),-I/usr/include/hdf5/openmpi))
HDF5_LINK := $(or $(shell pkg-config --libs $(HDF5_PACKAGE) 2>/dev/null), \
    -L/usr/lib/x86_64-linux-gnu/hdf5/openmpi -lhdf5)

PD_CFLAGS = -std=c11 $(OPTIMISE) -fno-math-errno -ffp-contract=fast -Wno-psabi \
    -g -fPIC -fvisibility=hidden \
    $(WARNINGS) -Wshadow -Wpedantic \
    $(DEPENDENCIES) -Ipd_solver/include $(CFLAGS_EXTRA)
PD_LIBS = $(HDF5_LINK) -lmetis -lm
TEST_CFLAGS = $(PD_CFLAGS) -Ipd_solver/src -Wno-unused-parameter

# The standard that OpenFOAM itself is compiled with.
CXX_STANDARD := c++$(shell api='$(FOAM_API)'; \
    if [ "$${api:-0}" -ge 2312 ]; then echo 17; \
    elif [ "$${api:-0}" -ge 2106 ]; then echo 14; else echo 11; fi)

FOAM_INCLUDES = \
    OpenFOAM \
    OSspecific/POSIX \
    finiteVolume \
    fvOptions \
    meshTools \
    fileFormats \
    surfMesh \
    lagrangian/basic \
    dynamicMesh \
    sampling \
    parallel/decompose/decompositionMethods \
    thermophysicalModels/basic
# FOAM_MPI names the folder of libPstream, in an OpenFOAM environment that was sourced.
FOAM_LIBS = -L$(FOAM_LIB) -L$(FOAM_LIB)/$(FOAM_MPI) \
    -lOpenFOAM -lPstream -lfiniteVolume -lfvOptions -lmeshTools -llagrangian \
    -ldecompositionMethods -lfluidThermophysicalModels

# pd.h names MPI's communicator. As system headers, so that only our own warnings count.
MPI_COMPILE := $(patsubst -I%,-isystem %,$(shell $(CC) --showme:compile 2>/dev/null))
MPI_LINK := $(shell $(CC) --showme:link 2>/dev/null)

ADAPTER_CXXFLAGS = -std=$(CXX_STANDARD) $(FOAM_FLAGS) \
    -DOMPI_SKIP_MPICXX -DMPICH_SKIP_MPICXX \
    $(OPTIMISE) -fno-math-errno -fPIC -ftemplate-depth-100 \
    $(WARNINGS) -Wnon-virtual-dtor -Wno-unused-parameter -Wno-old-style-cast \
    -Wno-alloc-size-larger-than -Wno-invalid-offsetof -Wno-attributes -Wno-unknown-pragmas \
    $(DEPENDENCIES) $(addprefix -I,$(sort $(dir $(ADAPTER_SOURCES)))) -Ipd_solver/include \
    $(FOAM_INCLUDES:%=-isystem $(FOAM_SRC)/%/lnInclude) $(MPI_COMPILE) $(CXXFLAGS_EXTRA)

# OpenFOAM selects models at run time: the linker cannot see which libraries are needed.
ADAPTER_LDFLAGS = -Wl,--no-as-needed $(LDFLAGS_EXTRA)

# --- libraries --------------------------------------------------------------------------

PD_OBJECTS = $(PD_SOURCES:%.c=build/objects/%.o) $(PD_KERNELS:%.c=build/objects/%.o)
ifeq ($(shell uname -m),x86_64)
PD_OBJECTS += $(PD_KERNELS:%.c=build/objects/%.avx2.o) $(PD_KERNELS:%.c=build/objects/%.avx512.o)
endif
ADAPTER_OBJECTS = $(ADAPTER_SOURCES:%.C=build/objects/%.o)

APPLICATIONS = periSolidFoam periResume periCheck
APPLICATION_OBJECTS = $(foreach a,$(APPLICATIONS),build/objects/foam_adapter/applications/$a/$a.o)

library: lib/libpd.a lib/libpd.so
adapter: lib/libperiFoam.so
applications: $(APPLICATIONS:%=bin/%)

# On the Makefile too: a source may have left the list, a flag may have changed.
lib/libpd.a: $(PD_OBJECTS) Makefile
	@mkdir -p $(@D) && rm -f $@
	$(call brief,AR)$(AR) rcs $@ $(PD_OBJECTS)

lib/libpd.so: $(PD_OBJECTS) Makefile
	@mkdir -p $(@D)
	$(call brief,LD)$(CC) -shared -Wl,-soname,$(@F) -Wl,-z,defs -o $@ $(PD_OBJECTS) \
	    $(LDFLAGS_EXTRA) $(PD_LIBS)

# With every symbol resolved: a library that does not load leaves a run uncoupled.
# Never unloaded: at its end MPI calls HDF5, which has asked for that.
lib/libperiFoam.so: $(ADAPTER_OBJECTS) lib/libpd.a Makefile
	@mkdir -p $(@D)
	$(call brief,LD)$(CXX) -shared -Wl,-soname,$(@F) -Wl,-z,defs,-z,nodelete -o $@ $(ADAPTER_OBJECTS) \
	    lib/libpd.a $(ADAPTER_LDFLAGS) $(FOAM_LIBS) $(MPI_LINK) $(PD_LIBS)

.SECONDEXPANSION:
bin/%: build/objects/foam_adapter/applications/$$*/$$*.o lib/libperiFoam.so Makefile
	@mkdir -p $(@D)
	$(call brief,LD)$(CXX) -o $@ $< -Wl,-rpath,'$$ORIGIN/../lib' $(ADAPTER_LDFLAGS) \
	    -Llib -lperiFoam $(FOAM_LIBS) $(MPI_LINK)

build/objects/pd_solver/%.o: pd_solver/%.c Makefile
	@mkdir -p $(@D)
	$(call brief,CC)$(CC) $(PD_CFLAGS) -c -o $@ $<

build/objects/pd_solver/src/hdf5_file.o: PD_CFLAGS += $(HDF5_COMPILE)

build/objects/pd_solver/%.avx2.o: pd_solver/%.c Makefile
	@mkdir -p $(@D)
	$(call brief,CC)$(CC) $(PD_CFLAGS) -mavx2 -mfma -c -o $@ $<

build/objects/pd_solver/%.avx512.o: pd_solver/%.c Makefile
	@mkdir -p $(@D)
	$(call brief,CC)$(CC) $(PD_CFLAGS) -mavx512f -mavx512dq -mavx512vl -mfma -c -o $@ $<

build/objects/foam_adapter/%.o: foam_adapter/%.C Makefile .cache/openfoam.mk
	@mkdir -p $(@D)
	$(call brief,CXX)$(CXX) $(ADAPTER_CXXFLAGS) -c -o $@ $<

# --- tests ------------------------------------------------------------------------------

# tests/run runs what is in build/tests, and finds the applications of build/bin by name.
UNIT_PROGRAMS = $(UNIT_TESTS:%=build/tests/%)
UNIT_OBJECTS = $(UNIT_TESTS:%=build/objects/tests/unit/%.o)
PARALLEL_PROGRAMS = $(PARALLEL_TESTS:%=build/parallel/%)
PARALLEL_OBJECTS = $(PARALLEL_TESTS:%=build/objects/tests/parallel/%.o)
TRANSFER_OBJECTS = $(TEST_APPLICATIONS:build/bin/%=build/objects/tests/transfer/%.o)
TEST_APPLICATIONS = build/bin/testTransfer build/bin/testRanks

.SECONDARY: $(UNIT_OBJECTS) $(PARALLEL_OBJECTS) $(TRANSFER_OBJECTS)

build/objects/tests/%.o: tests/%.c Makefile
	@mkdir -p $(@D)
	$(call brief,CC)$(CC) $(TEST_CFLAGS) -c -o $@ $<

# They count the handles of HDF5 that are open.
$(addprefix build/objects/tests/,unit/test_files.o unit/test_checkpoint.o parallel/test_files.o \
    parallel/test_checkpoint.o): TEST_CFLAGS += $(HDF5_COMPILE)

build/tests/test_formulations: build/objects/tests/reference/reference_correspondence.o
build/tests/test_bond: build/objects/tests/reference/reference_bond.o
build/tests/test_bond_associated: build/objects/tests/reference/reference_bond_associated.o

# Disks that cannot reserve space.
build/tests/test_files: TEST_LDFLAGS = -Wl,--wrap=fallocate

build/tests/%: build/objects/tests/unit/%.o lib/libpd.a
	@mkdir -p $(@D)
	$(call brief,LD)$(CC) -o $@ $(filter %.o,$^) lib/libpd.a $(TEST_LDFLAGS) $(LDFLAGS_EXTRA) \
	    -lcmocka $(PD_LIBS)

build/parallel/%: build/objects/tests/parallel/%.o lib/libpd.a
	@mkdir -p $(@D)
	$(call brief,LD)$(CC) -o $@ $< lib/libpd.a $(LDFLAGS_EXTRA) $(PD_LIBS)

build/objects/tests/%.o: tests/%.C Makefile .cache/openfoam.mk
	@mkdir -p $(@D)
	$(call brief,CXX)$(CXX) $(ADAPTER_CXXFLAGS) -c -o $@ $<

$(TEST_APPLICATIONS): build/bin/%: build/objects/tests/transfer/%.o lib/libperiFoam.so
	@mkdir -p $(@D)
	$(call brief,LD)$(CXX) -o $@ $< -Wl,-rpath,'$$ORIGIN/../../lib' $(ADAPTER_LDFLAGS) \
	    -Llib -lperiFoam $(FOAM_LIBS) $(MPI_LINK)

test: all try-pictures $(UNIT_PROGRAMS) $(PARALLEL_PROGRAMS) $(TEST_APPLICATIONS)
	@rm -f $(filter-out $(UNIT_PROGRAMS),$(wildcard build/tests/*))
	@rm -f $(filter-out $(PARALLEL_PROGRAMS),$(wildcard build/parallel/*))
	@tests/run $(FILTER)

# Without them the tests of what they draw are left out, and say so.
try-pictures:
	@scripts/bootstrap build pictures || echo 'without ParaView: what it shows is not tested' >&2

# What reads files, instrumented; the rest of the library as it is.
FUZZ_SECONDS = $(or $(SECONDS),60)
FUZZ_SOURCES = tests/fuzz/fuzz_checkpoint.c \
    $(addprefix pd_solver/src/,checkpoint.c hdf5_file.c rows.c checksum.c collective.c halo.c status.c)

build/fuzz/fuzz_checkpoint: $(FUZZ_SOURCES) lib/libpd.a
	@mkdir -p $(@D)/corpus
	$(call brief,LD)clang -std=c11 -g -O1 -fsanitize=fuzzer,address,undefined \
	    -fno-sanitize-recover=undefined -Ipd_solver/include $(HDF5_COMPILE) $(MPI_COMPILE) \
	    -o $@ $(FUZZ_SOURCES) lib/libpd.a $(PD_LIBS) $(MPI_LINK)

# SECONDS=<n>: how long; what makes it fail is left in build/fuzz.
fuzz-reader: build/fuzz/fuzz_checkpoint
	cd build/fuzz && ./fuzz_checkpoint -max_total_time=$(FUZZ_SECONDS) -max_len=8192 \
	    -print_final_stats=1 corpus

# What goes wrong from outside: docs/faults.md. Longer than `make test`, and not part of it.
faults: all
	@tests/faults/run $(FILTER)

# The C library and its tests again, in a folder of their own, with AddressSanitizer (and what
# leaks, on two ranks too) and UndefinedBehaviorSanitizer; then some under valgrind, which sees
# reads of what was never set.
SANITIZE = -fsanitize=address,undefined -fno-sanitize-recover=undefined -fno-omit-frame-pointer
VALGRIND_TESTS = test_body test_damage test_files

unit-programs: $(UNIT_PROGRAMS)
parallel-programs: $(PARALLEL_PROGRAMS)

sanitize: $(VALGRIND_TESTS:%=build/tests/%)
	@mkdir -p build/sanitized && cp -rp Makefile pd_solver tests build/sanitized
	@$(MAKE) -C build/sanitized --no-print-directory OPTIMISE=-O1 \
	    CFLAGS_EXTRA='$(SANITIZE)' LDFLAGS_EXTRA='$(SANITIZE)' unit-programs \
	    parallel-programs
	@cd build/sanitized && rm -f build/tests/*.log && for t in build/tests/*; do \
	    echo $$t && $$t >$$t.log 2>&1 || { cat $$t.log; exit 1; }; rm $$t.log; done
	@tests/parallel/leaks build/sanitized/build/parallel
	@for t in $^; do echo valgrind $$t && valgrind -q --error-exitcode=9 --leak-check=full \
	    $$t >$$t.log 2>&1 || { cat $$t.log; exit 1; }; rm $$t.log; done

# --- benchmarks -------------------------------------------------------------------------

BENCH_PROGRAMS = $(BENCHES:%=build/bench/%)
BENCH_OBJECTS = $(BENCHES:%=build/objects/pd_solver/bench/%.o)

.SECONDARY: $(BENCH_OBJECTS)

build/objects/pd_solver/bench/bench_files.o: PD_CFLAGS += -Ipd_solver/src

build/bench/%: build/objects/pd_solver/bench/%.o lib/libpd.a
	@mkdir -p $(@D)
	$(call brief,LD)$(CC) -o $@ $< lib/libpd.a $(LDFLAGS_EXTRA) $(PD_LIBS)

bench-programs: $(BENCH_PROGRAMS)

bench: bench-programs bench-tools
	scripts/bench --write $(SIZE:%=--size %)

# --- cases ------------------------------------------------------------------------------

demo: all pictures
	scripts/demo

# NAMES='cavity jet': only these.
tutorials: all
	scripts/tutorials $(NAMES)

validate: all
	scripts/validate elastic_band

# LEVEL=full: hours. Both go on where they were stopped; SECONDS=<n>: stop by themselves.
chart: all
	scripts/chart $(LEVEL:%=--level %) $(SECONDS:%=--limit %)

stability: all
	scripts/stability $(SECONDS:%=--limit %)

# --- the rest ---------------------------------------------------------------------------

bootstrap:
	@scripts/bootstrap build

pictures:
	@scripts/bootstrap build pictures

bench-tools:
	@scripts/bootstrap build bench

# Where OpenFOAM looks for what its user has built; with other folders by
# make install FOAM_USER_LIBBIN=<lib> FOAM_USER_APPBIN=<bin>, side by side: programs look in ../lib
install: all
	@[ -n "$(FOAM_USER_LIBBIN)" ] && [ -n "$(FOAM_USER_APPBIN)" ] || { \
	    echo 'make install: FOAM_USER_LIBBIN and FOAM_USER_APPBIN are not set; source your' \
	        'OpenFOAM'"'"'s etc/bashrc, or name two folders' >&2; exit 1; }
	mkdir -p "$(FOAM_USER_LIBBIN)" "$(FOAM_USER_APPBIN)"
	cp lib/libpd.so lib/libperiFoam.so "$(FOAM_USER_LIBBIN)"
	cp $(APPLICATIONS:%=bin/%) "$(FOAM_USER_APPBIN)"

# What git knows of the last commit
DIST = periFoam-$(shell git describe --always 2>/dev/null)
dist:
	@mkdir -p build
	git archive --prefix=$(DIST)/ -o build/$(DIST).tar.gz HEAD
	@echo build/$(DIST).tar.gz

# <options of clang-format>: our C files, those that git does not know yet too. C++ keeps the
# layout of OpenFOAM, which clang-format cannot express.
define clang_format
	@if command -v clang-format >/dev/null; then \
	    git ls-files -z --cached --others --exclude-standard -- \
	        'pd_solver/*.[ch]' 'tests/*.[ch]' | \
	    xargs -0 -r clang-format $(1); \
	else \
	    echo 'clang-format is not installed: nothing was done'; \
	fi
endef

format:
	$(call clang_format,-i)

check-format:
	$(call clang_format,--dry-run --Werror)

clean:
	rm -rf build lib bin

distclean: clean
	rm -rf .cache

help:
	@echo 'make                 libraries: lib/libpd.a, lib/libpd.so, lib/libperiFoam.so;'
	@echo '                     applications bin/periSolidFoam, bin/periResume, bin/periCheck'
	@echo 'make library         the C library alone, which needs no OpenFOAM'
	@echo 'make bootstrap       install what a build needs (scripts/bootstrap build)'
	@echo 'make test            build all and run the tests; FILTER=<word> runs some'
	@echo 'make faults          kills, damaged files, mutated dictionaries; FILTER=<word> runs some'
	@echo 'make demo            one coupled case, from the mesh to the pictures'
	@echo 'make tutorials       bodies in OpenFOAM'"'"'s own tutorials; NAMES=...: only these'
	@echo 'make validate        the elastic band against its reference'
	@echo 'make chart           error against cost: docs/speed_accuracy.md; LEVEL=full is all of it;'
	@echo '                     then scripts/advise <case> <quantity> --error 2% answers'
	@echo 'make stability       where methods fail: docs/limits.md; both take SECONDS=<most>'
	@echo 'make bench           how fast forces are: docs/bench.md; SIZE=small is quicker'
	@echo 'make sanitize        the tests of the C library with sanitizers and valgrind'
	@echo 'make fuzz-reader     any bytes in place of a checkpoint, for SECONDS=60; needs clang'
	@echo 'make install         into FOAM_USER_LIBBIN and FOAM_USER_APPBIN'
	@echo 'make dist            build/periFoam-<commit>.tar.gz'
	@echo 'make format          lay out the sources with clang-format'
	@echo 'make check-format    fail if that would change them'
	@echo 'make clean           remove build, lib and bin'
	@echo 'make distclean       remove .cache too'
	@echo
	@echo 'Variables: CC CXX AR OPTIMISE WERROR CFLAGS_EXTRA CXXFLAGS_EXTRA LDFLAGS_EXTRA V'

-include $(PD_OBJECTS:.o=.d) $(ADAPTER_OBJECTS:.o=.d) $(APPLICATION_OBJECTS:.o=.d) \
    $(UNIT_OBJECTS:.o=.d) $(PARALLEL_OBJECTS:.o=.d) $(BENCH_OBJECTS:.o=.d) \
    $(TRANSFER_OBJECTS:.o=.d)
