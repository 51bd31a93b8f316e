# From a CT stack to the report, one rule a step. Called by the Makefile beside it, after the build. A step runs again when one of its
# inputs, its options or its program has changed.
include $(dir $(lastword $(MAKEFILE_LIST)))common.mk
.DEFAULT_GOAL := report

#:
#: Variables of `curves` (unset: the default of the tool; quantities take units, such as 30um):
#:   CT          stack: multi-page TIFF, .nrrd, .mha, .raw, file.h5:/dataset, or a folder of slices
#:   VOXEL       voxel size, or x,y,z sizes; unset: that of the file
#:   SOLID       bright, dark or a grey value          SPLIT     none or watershed (grains that touch)
#:   THRESHOLD   grey value or otsu                    LABELS    auto, binary or labels
#:   SCALE_TO    diameter all grains are scaled to     SPACING   of the level sets
#:   DEGREE      of the spherical harmonics
#:   SPEC        packing (docs/pack-spec.md), default pipeline/specs/demo.toml
#:   VELOCITY    of the inflow        ANGLE     between flow and gravity        HOLE   edge of the filter's holes, PITCH apart
#:   CELL        of the flow grid     DURATION  simulated time
#:   SEED        of the packing       THREADS   of every tool
#:   OUT         folder of all results, default build/curves
#: More options of a tool: CSCT2LS_OPTIONS, LS2SH_OPTIONS, PACK_OPTIONS, CASE_OPTIONS.
OUT ?= $(root)/build/curves
SPEC ?= $(here)/specs/demo.toml
spec := $(call from_caller,$(SPEC))
out := $(call from_caller,$(OUT))
ifeq ($(CT),)
    $(error name your stack: make -C pipeline CT=stack.tif VOXEL=30um curves)
endif

csct2ls := $(bin)/csct2ls '$(stack)' $(stack_options) $(threads)
ls2sh := $(bin)/ls2sh $(out)/grains.vdb $(call option,--degree,DEGREE) $(LS2SH_OPTIONS) $(threads)
pack := $(bin)/pack-sample $(spec) --grains $(out)/grains.vdb $(call option,--seed,SEED) $(PACK_OPTIONS) $(threads)
case := $(bin)/make-case $(out)/sample.h5 $(call option,--velocity,VELOCITY) $(call option,--angle,ANGLE) $(call option,--hole,HOLE) $(call option,--pitch,PITCH) \
    $(call option,--cell,CELL) $(call option,--duration,DURATION) $(CASE_OPTIONS) $(threads)
suffuse := $(bin)/suffuse $(out)/case $(threads)
report := $(bin)/erosion-report $(out)/case

# .<step>.options holds the command of a step and changes only when that does.
.PHONY: report
$(out)/.%.options: always
	$(call remember,$($*))

$(out)/grains.vdb: $(stack_file) $(bin)/csct2ls $(out)/.csct2ls.options
	$(call say,csct2ls: grains and their voids from the stack)
	@$(csct2ls) -o $@ --table $(out)/grains.csv

$(out)/grains.sh.h5: $(out)/grains.vdb $(bin)/ls2sh $(out)/.ls2sh.options
	$(call say,ls2sh: spherical harmonics of the apparent shapes)
	@$(ls2sh) -o $@ --table $(out)/grains_sh.csv

$(out)/sample.h5: $(out)/grains.vdb $(spec) $(bin)/pack-sample $(out)/.pack.options
	$(call say,pack-sample: gap-graded sample)
	@$(call resumable,$@.checkpoint,$^); $(pack) $$resume -o $@
	@[ ! -f $@.checkpoint ] || { echo "stopped before the end; the same make command goes on" >&2; exit 1; }

$(out)/case/case.toml: $(out)/sample.h5 $(bin)/make-case $(out)/.case.options
	$(call say,make-case: domain and plan of the run)
	@$(case) -o $(@D)

# A run that was interrupted goes on from its checkpoint, as a packing does, unless the case is newer.
$(out)/suffuse.txt: $(out)/case/case.toml $(bin)/suffuse $(out)/.suffuse.options
	$(call say,suffuse: flow and erosion)
	@$(call resumable,$(out)/case/checkpoint.h5,$(out)/case/case.toml $(bin)/suffuse); $(suffuse) $$resume | tee $@
	@! grep -q 'go on with --resume' $@ || { echo "stopped before the end; the same make command goes on" >&2; exit 1; }

$(out)/report/report.html: $(out)/suffuse.txt $(bin)/erosion-report $(out)/.report.options
	$(call say,erosion-report: curves and figures)
	@$(report) -o $(@D)

report: $(out)/grains.sh.h5 $(out)/report/report.html
	@echo
	@echo "report: $(out)/report/report.html"
	@sed -n 's/^eroded  */eroded: /p' $(out)/suffuse.txt
