# The numerical studies of Huang et al. (section 5) as runs that share grains, packings and, where they can, each other. Called by the
# Makefile beside it, after the build. What is finished is made again only when its options or its input change, not when a program
# was built anew: a study may take days. Remove a folder to have it made again.
include $(dir $(lastword $(MAKEFILE_LIST)))common.mk

#:
#: Studies (each draws one report over all its runs; runs that two studies share are made once):
#:   make -C pipeline paper      the paper's case: level-set grains with voids, spheres as fines (LS-sphere)
#:   make -C pipeline voids      with and without intraparticle voids: LS-sphere, SH-sphere
#:   make -C pipeline shapes     LS-polyhedral, LS-sphere, sphere-sphere
#:   make -C pipeline velocity   inflow of 0.01, 0.05, 0.10 m/s
#:   make -C pipeline angle      0, 45, 90 deg between flow and gravity
#:   make -C pipeline studies    all of them: eight runs for every seed
#:   SCALE=small (default)       13 coarse and about 1000 fine grains: minutes a run; pipeline/specs/small.toml
#:   SCALE=paper                 the full case: 50 and 3900, 1.8 million cells; specs/paper.toml
#:   SEEDS=n                     n packings of each sample; reports then show mean and spread
#:   CT=stack VOXEL=30um         your grains, scaled to 15 mm; otherwise coral-like ones of make-sample-ct
#:   DURATION, CELL, SPACING, HOLE, PITCH, THREADS as above; DEM_STEP of contact (SCALE=paper: 2us, as there)
#:   SPEC, SPEC_SPHERES          other packings; OUT, default build/studies/<SCALE>
#:   -j 2 THREADS=1              two runs at a time
#:   FINISHED=yes                report of the runs that are there, without making any
#:   make -C pipeline slurm STUDY=voids SCALE=paper SEEDS=5
#:                               writes OUT/voids.slurm.sh for a cluster (docs/cluster.md)
#: An interrupted study goes on where it was with the same command.
SCALE ?= small
SEEDS ?= 1
OUT ?= $(root)/build/studies/$(SCALE)
ifeq ($(filter $(SCALE),small paper),)
    $(error SCALE=$(SCALE) is not one of: small, paper)
endif
ifneq ($(shell [[ '$(SEEDS)' =~ ^[1-9][0-9]?[0-9]?$$ ]] && echo yes),yes)
    $(error SEEDS=$(SEEDS) is no number of packings from 1 to 999)
endif
seeds := $(shell seq 1 $(SEEDS))
out := $(call from_caller,$(OUT))
ifneq ($(findstring =,$(out)),)
    $(error OUT=$(out) holds a "=", which erosion-report reads as the end of a name; take another folder)
endif

# What the scales differ in.
# PITCH: the paper does not say how far apart the holes of its filter are. With webs of a third of a hole, three fifths open, conductivity and gradient
# take the paper's course; with a quarter open (what make-case takes by itself) fines bridge the webs and little leaves (docs/validation/suffusion.md).
defaults_small := SPACING=400um CELL=0.75mm DURATION=1s HOLE=6mm PITCH=7.7mm SAMPLE_VOXEL=0.25mm SAMPLE_GRAINS=10
defaults_paper := SPACING=200um CELL=0.5mm DURATION=2s HOLE=6mm PITCH=7.7mm SAMPLE_VOXEL=0.15mm SAMPLE_GRAINS=50 DEM_STEP=2us
$(foreach setting,$(defaults_$(SCALE)),$(eval $(firstword $(subst =, ,$(setting))) ?= $(lastword $(subst =, ,$(setting)))))
SCALE_TO ?= 15mm
# Samples that differ by shape are compared at the same pressure: without it harmonics leave the small sample at four times what it had, and
# fines that are held so much tighter do not erode. Harmonics of degree 10 miss a grain of 15 mm by more than a tenth of a fine: fines are moved
# by 11 to 18 % of their diameter on average (docs/swap-shapes.md), and those in voids have no place left.
SWAP_OPTIONS ?= --restore-pressure --steps 20000
SWAP_SH ?= --drop-trapped --limit 0.3
SPEC ?= $(here)/specs/$(SCALE).toml
SPEC_SPHERES ?= $(here)/specs/$(SCALE)-spheres.toml
spec := $(call from_caller,$(SPEC))
spec_spheres := $(call from_caller,$(SPEC_SPHERES))

# Runs as name,sample,velocity,angle; studies as run:label. The paper's own case serves in every study.
runs := ls-sphere,ls-sphere,0.1m/s,0deg sh-sphere,sh-sphere,0.1m/s,0deg ls-polyhedral,ls-polyhedral,0.1m/s,0deg \
    sphere-sphere,sphere-sphere,0.1m/s,0deg u0.05,ls-sphere,0.05m/s,0deg u0.01,ls-sphere,0.01m/s,0deg \
    angle45,ls-sphere,0.1m/s,45deg angle90,ls-sphere,0.1m/s,90deg
study_paper := ls-sphere:LS-sphere
study_voids := ls-sphere:LS-sphere sh-sphere:SH-sphere
study_shapes := ls-polyhedral:LS-polyhedral ls-sphere:LS-sphere sphere-sphere:sphere-sphere
study_velocity := u0.01:0.01_m/s u0.05:0.05_m/s ls-sphere:0.10_m/s
study_angle := ls-sphere:0_deg angle45:45_deg angle90:90_deg
studies := paper voids shapes velocity angle
comma := ,
part = $(word $(2),$(subst $(comma), ,$(1)))
before = $(word 1,$(subst :, ,$(1)))
after = $(word 2,$(subst :, ,$(1)))

.PHONY: $(studies) studies slurm list
studies: $(studies)
list:
	@printf '%s\n' $(foreach run,$(runs),$(foreach seed,$(seeds),$(out)/$(call part,$(run),1)/seed$(seed)/suffuse.txt))

# Grains: the user's stack, or one of ours.
ifeq ($(CT),)
stack := $(out)/grains.tif
stack_file := $(stack)
phantom := $(bin)/make-sample-ct --grains $(SAMPLE_GRAINS) --sticks 1 --diameter 15mm --spread 0.1 --porosity 0.3 --voxel-size $(SAMPLE_VOXEL) --seed 1 $(threads)
$(out)/.phantom.options: always
	$(call remember,$(notdir $(firstword $(phantom))) $(wordlist 2,99,$(phantom)))
$(stack): $(out)/.phantom.options | $(bin)/make-sample-ct
	$(call say,make-sample-ct: coral-like grains)
	@$(phantom) -o $@ --truth $(out)/grains_truth.csv
endif
grains := $(bin)/csct2ls '$(stack)' $(stack_options) $(threads)
$(out)/.grains.options: always
	$(call remember,$(notdir $(firstword $(grains))) $(wordlist 2,99,$(grains)))
$(out)/grains.vdb: $(stack_file) $(out)/.grains.options | $(bin)/csct2ls
	$(call say,csct2ls: level sets of the grains)
	@$(grains) -o $@ --table $(out)/grains.csv --voids $(out)/voids.csv

# $(call pack_rule,SAMPLE,SPEC,SEED,OPTIONS,GRAINS): a sample poured and compressed.
define pack_rule
$(out)/samples/.$(1)_seed$(3).options: always
	$$(call remember,pack-sample $(2) $(4) --seed $(3) $(PACK_OPTIONS))
$(out)/samples/$(1)_seed$(3).h5: $(2) $(5) $(out)/samples/.$(1)_seed$(3).options | $(bin)/pack-sample
	$$(call say,pack-sample: $(1)$$(comma) seed $(3))
	@$$(call resumable,$$@.checkpoint,$$^); $(bin)/pack-sample $(2) $(4) --seed $(3) $(PACK_OPTIONS) $(threads) $$$$resume -o $$@
	@[ ! -f $$@.checkpoint ] || { echo "stopped before the end; the same make command goes on" >&2; exit 1; }
endef

# $(call swap_rule,SAMPLE,OPTIONS,SEED): other shapes in the places of the sample ls-sphere.
define swap_rule
$(out)/samples/.$(1)_seed$(3).options: always
	$$(call remember,swap-shapes $(2) --seed $(3) $(SWAP_OPTIONS))
$(out)/samples/$(1)_seed$(3).h5: $(out)/samples/ls-sphere_seed$(3).h5 $(out)/samples/.$(1)_seed$(3).options | $(bin)/swap-shapes
	$$(call say,swap-shapes: $(1)$$(comma) seed $(3))
	@$(bin)/swap-shapes $$< $(2) --seed $(3) $(SWAP_OPTIONS) $(threads) -o $$@
endef

case_options := $(call option,--hole,HOLE) $(call option,--pitch,PITCH) $(call option,--cell,CELL) $(call option,--duration,DURATION) $(call option,--dem-step,DEM_STEP) \
    $(CASE_OPTIONS)
# $(call run_rule,RUN,SAMPLE,VELOCITY,ANGLE,SEED): case and coupled run.
define run_rule
$(out)/$(1)/seed$(5)/.case.options: always
	$$(call remember,make-case --velocity $(3) --angle $(4) $(case_options))
$(out)/$(1)/seed$(5)/case.toml: $(out)/samples/$(2)_seed$(5).h5 $(out)/$(1)/seed$(5)/.case.options | $(bin)/make-case
	$$(call say,make-case: $(1)$$(comma) seed $(5))
	@$(bin)/make-case $$< --velocity $(3) --angle $(4) $(case_options) $(threads) -o $$(@D)
$(out)/$(1)/seed$(5)/suffuse.txt: $(out)/$(1)/seed$(5)/case.toml | $(bin)/suffuse
	$$(call say,suffuse: $(1)$$(comma) seed $(5))
	@$$(call resumable,$$(@D)/checkpoint.h5,$$<); $(bin)/suffuse $$(@D) $(threads) $$$$resume >$$@.part
	@! grep -q 'go on with --resume' $$@.part || { echo "stopped before the end; the same make command goes on" >&2; exit 1; }
	@mv $$@.part $$@; sed -n 's/^eroded  */$(1), seed $(5): eroded /p' $$@
endef

$(foreach seed,$(seeds),$(eval $(call pack_rule,ls-sphere,$(spec),$(seed),--grains $(out)/grains.vdb,$(out)/grains.vdb)))
$(foreach seed,$(seeds),$(eval $(call pack_rule,sphere-sphere,$(spec_spheres),$(seed),,)))
$(foreach seed,$(seeds),$(eval $(call swap_rule,sh-sphere,$(strip --coarse sh $(SWAP_SH)),$(seed))))
$(foreach seed,$(seeds),$(eval $(call swap_rule,ls-polyhedral,--fine polyhedron,$(seed))))
$(foreach run,$(runs),$(foreach seed,$(seeds),$(eval $(call \
    run_rule,$(call part,$(run),1),$(call part,$(run),2),$(call part,$(run),3),$(call part,$(run),4),$(seed)))))

# Samples stay when make thinks of them as a step on the way.
.SECONDARY:

# $(call results_of,STUDY): the last file of every run.
results_of = $(foreach run,$(study_$(1)),$(foreach seed,$(seeds),$(out)/$(call before,$(run))/seed$(seed)/suffuse.txt))
# $(call labelled,STUDY): the runs as LABEL=FOLDER, those that have results when FINISHED is set; seeds of one run share the label.
labelled = $(foreach run,$(study_$(1)),$(foreach seed,$(seeds),$(if $(or $(if $(FINISHED),,yes),$(wildcard $(out)/$(call before,$(run))/seed$(seed)/results.h5)),\
    '$(subst _, ,$(call after,$(run)))=$(out)/$(call before,$(run))/seed$(seed)')))
define study_rule
$(out)/$(1)/.report.options: always
	$$(call remember,erosion-report $(call labelled,$(1)))
$(out)/$(1)/report/report.html: $(if $(FINISHED),,$(call results_of,$(1))) $(out)/$(1)/.report.options $(bin)/erosion-report
	$$(call say,erosion-report: $(1))
	@[ -n "$$(strip $(call labelled,$(1)))" ] || { echo "no run of the study $(1) has results yet" >&2; exit 1; }
	@$(bin)/erosion-report $(call labelled,$(1)) $(REPORT_OPTIONS) -o $$(@D)
$(1): $(out)/$(1)/report/report.html
	@echo "report: $$<"
endef
$(foreach study,$(studies),$(eval $(call study_rule,$(study))))

# Jobs of a cluster: one array for the samples, one for the runs, then the report.
STUDY ?= voids
samples_of = $(sort $(foreach run,$(runs),$(if $(filter $(call part,$(run),1):%,$(study_$(STUDY))),$(foreach seed,$(seeds),$(out)/samples/$(call part,$(run),2)_seed$(seed).h5))))
slurm:
	@[ -n '$(study_$(STUDY))' ] || { echo "STUDY=$(STUDY) is not one of: $(studies)" >&2; exit 1; }
	@mkdir -p $(out)
	@$(here)/slurm.sh '$(here)/studies.mk' '$(STUDY)' '$(out)' '$(out)/grains.vdb' '$(samples_of)' '$(call results_of,$(STUDY))' \
	    $(foreach name,SCALE SEEDS OUT CT VOXEL SOLID SPLIT THRESHOLD LABELS SCALE_TO SPACING CSCT2LS_OPTIONS SPEC SPEC_SPHERES CELL DURATION HOLE PITCH DEM_STEP PACK_OPTIONS \
	        SWAP_OPTIONS SWAP_SH CASE_OPTIONS REPORT_OPTIONS SAMPLE_VOXEL SAMPLE_GRAINS bin,'$(name)=$(if $(filter OUT,$(name)),$(out),$(if $(filter CT,$(name)),$(if $(CT),$(stack)),$(if $(filter \
	        SPEC,$(name)),$(spec),$(if $(filter SPEC_SPHERES,$(name)),$(spec_spheres),$($(name))))))') >$(out)/$(STUDY).slurm.part
	@chmod +x $(out)/$(STUDY).slurm.part && mv $(out)/$(STUDY).slurm.part $(out)/$(STUDY).slurm.sh
	@echo "jobs: $(out)/$(STUDY).slurm.sh"
