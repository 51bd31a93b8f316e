#!/bin/bash
# Man pages out of what the tools say of themselves, so that they cannot fall behind.   Usage: manpages.sh <bin folder> <output folder> TOOL...
set -euo pipefail
bin=$1 out=$2
shift 2
mkdir -p "$out"
for tool in "$@"; do
    version=$("$bin/$tool" --version | sed -n 's/^\([^ ]* \)\?\([0-9][0-9.]*\).*/\2/p' | head -1)
    "$bin/$tool" --help | awk -v tool="$tool" -v version="$version" '
        # A line that begins with a dot or a quote is a command to roff, and a hyphen may become a dash.
        function safe(text) { gsub(/\\/, "\\e", text); gsub(/-/, "\\-", text); sub(/^[.\x27]/, "\\\\\\&&", text); return text }
        NR == 1 { printf ".TH %s 1 \"\" \"coralsand %s\" \"Coralsand\"\n.SH NAME\n%s \\- %s\n", toupper(tool), version, safe(tool), safe(tolower(substr($0, 1, 1)) substr($0, 2)); next }
        /^Usage:/ { sub(/^Usage: */, ""); printf ".SH SYNOPSIS\n%s\n", safe($0); next }
        /^[A-Z][A-Za-z ]*:$/ { sub(/:$/, ""); printf ".SH %s\n", toupper($0); next }
        /^$/ { next }
        /^  [^ ]/ {
            # "  --name TEXT=1    what it does": two spaces or more between the parts, or the text on the next line.
            line = substr($0, 3); at = match(line, /  +/)
            if (at) printf ".TP\n.B %s\n%s\n", safe(substr(line, 1, at - 1)), safe(substr(line, at + RLENGTH))
            else printf ".TP\n.B %s\n", safe(line)
            next
        }
        { sub(/^ +/, ""); print safe($0) }
        END { printf ".SH EXIT STATUS\n0 done, 1 the work failed, 2 wrong command line or configuration.\n.SH UNITS\nQuantities take units (30um, 0.2mm, 50kPa, 0.1m/s, 45deg); a bare number is SI.\n" }' >"$out/$tool.1.part"
    mv "$out/$tool.1.part" "$out/$tool.1"
done
