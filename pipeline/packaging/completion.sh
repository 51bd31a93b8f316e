#!/bin/bash
# Completion of options and of their fixed values for bash (zsh: bashcompinit), out of --help.   Usage: completion.sh <bin folder> <output file> TOOL...
set -euo pipefail
bin=$1 out=$2
shift 2
mkdir -p "$(dirname "$out")"
{
    echo "# bash completion of the Coralsand tools; made by completion.sh from their --help."
    echo "_coralsand() {"
    echo '    local word=${COMP_WORDS[COMP_CWORD]} last=${COMP_WORDS[COMP_CWORD-1]} tool=${COMP_WORDS[0]##*/}'
    echo '    COMPREPLY=()'
    echo '    case $tool:$last in'
    for tool in "$@"; do
        # "--coarse TEXT:{keep,level-set}=keep" and "auto, binary or labels" after an option are its values.
        "$bin/$tool" --help | sed -n 's/^ *\(-[a-zA-Z],\)\?\(--[a-z-]*\) [A-Z]*:{\([^}]*\)}.*/\2 \3/p' | while read -r option values; do
            printf '        %s:%s) COMPREPLY=($(compgen -W "%s" -- "$word")); return ;;\n' "$tool" "$option" "${values//,/ }"
        done
    done
    echo '    esac'
    echo '    if [[ $word == -* ]]; then'
    echo '        case $tool in'
    for tool in "$@"; do
        options=$("$bin/$tool" --help | grep -oE '^ +(-[a-zA-Z],)?--[a-z-]+' | grep -oE -e '--[a-z-]+' | sort -u | tr '\n' ' ')
        printf '            %s) COMPREPLY=($(compgen -W "%s" -- "$word")) ;;\n' "$tool" "${options% }"
    done
    echo '        esac'
    echo '    fi'
    echo '}'
    echo "complete -o default -F _coralsand $*"
} >"$out.part"
mv "$out.part" "$out"
