# What chain.mk and studies.mk share: where things are, and options that are passed on only when they are set.
SHELL := /bin/bash
.SHELLFLAGS := -euo pipefail -c
.DELETE_ON_ERROR:
here := $(patsubst %/,%,$(dir $(abspath $(lastword $(MAKEFILE_LIST)))))
root := $(patsubst %/,%,$(dir $(here)))
bin ?= $(root)/build/release/bin

# Paths are relative to the folder that make was called from.
from_caller = $(if $(filter /%,$(1)),$(1),$(abspath $(or $(CALLER),.)/$(1)))
stack := $(if $(CT),$(call from_caller,$(CT)))
stack_file := $(firstword $(subst .h5:,.h5 ,$(stack)))

# $(call option,--velocity,VELOCITY): the option with the value of the variable, or nothing.
option = $(if $($(2)),$(1) '$($(2))')
threads := $(call option,--threads,THREADS)
stack_options = $(call option,--voxel-size,VOXEL) $(call option,--solid,SOLID) $(call option,--split,SPLIT) $(call option,--threshold,THRESHOLD) \
    $(call option,--labels,LABELS) $(call option,--scale-to,SCALE_TO) $(call option,--spacing,SPACING) $(CSCT2LS_OPTIONS)
say = @echo "== $(1)"

# $(call remember,COMMAND): recipe of a file that holds a command and changes only when that does. Threads do not change what a tool makes.
threadless = $(strip $(subst $(threads),,$(1)))
remember = @mkdir -p $(@D); cmp -s - $@ <<<"$(threadless)" || echo "$(threadless)" >$@

# $(call resumable,CHECKPOINT,FILES): sets $$resume when the checkpoint is newer than all files that the step depends on.
resumable = resume=; if [ -f $(1) ]; then resume=--resume; for newer in $(2); do [ $(1) -nt $$newer ] || resume=; done; fi
.PHONY: always
