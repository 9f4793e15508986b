#!/bin/sh
# Man pages from what the program says of itself, so that they cannot go stale: caustica(1) from `caustica --help`,
# and caustica-COMMAND(1) from `caustica COMMAND --help` of each command named there. Those texts come from the tables
# of options.
#
#   scripts/help-to-man.sh CAUSTICA FOLDER
#
# What the help of a command is made of: a first line "caustica COMMAND WORDS: what it does", or two after the colon;
# options, "  -o, --output FILE  text", where the text may stand in the next line; paragraphs; lines that begin with
# two or more spaces, which stay as they are; "Example: words", or "Examples: words" and lines with more of them under
# the first word.
set -eu
program=$1 folder=$2
mkdir -p "$folder"

commands=$("$program" --help | awk '/^  [a-z]/ && $1 != "caustica" { print $1 }')
version=$("$program" --version)

to_man() { # to_man NAME: from a help text to a page
    awk -v name="$1" -v version="$version" -v commands="$(echo $commands)" '
    function escaped(text)
    {
        gsub(/\\/, "\\e", text)
        gsub(/-/, "\\-", text)
        gsub(/\047/, "\\(aq", text)
        sub(/^\./, "\\\\\\&.", text)
        return text
    }
    function section(title) { if (current != title) print ".SH " title; current = title; filled = 1 }
    function as_is(wanted) { if (wanted != kept) print wanted ? ".PP\n.nf" : ".fi"; kept = wanted }
    BEGIN {
        page = name
        gsub(/ /, "-", page)
        print ".TH " toupper(escaped(page)) " 1 \"\" \"" version "\" \"User Commands\""
    }
    NR == 1 {
        colon = match($0, /:( |$)/)
        usage = substr($0, 1, colon - 1)
        what = substr($0, colon + 2)
        if (what == "") { # it did not fit
            getline what
        }
        print ".SH NAME\n" escaped(page) " \\- " escaped(what)
        print ".SH SYNOPSIS\n.B " (name == "caustica" ? "caustica\n.I command\n\\&..." : escaped(usage))
        next
    }
    name == "caustica" && /^  caustica COMMAND \.\.\.$/ { next }
    /^Examples?: / || (current == "EXAMPLES" && /^          caustica /) {
        as_is(0)
        section("EXAMPLES")
        sub(/^(Examples?:)? +/, "")
        print ".PP\n.nf\n" escaped($0) "\n.fi"
        next
    }
    /^Exit status: / {
        as_is(0)
        section("EXIT STATUS")
        sub(/^Exit status: /, "")
        print escaped($0)
        next
    }
    name == "caustica" && /^  [a-z]/ && $1 != "caustica" {
        section("COMMANDS")
        text = $0
        sub(/^ *[a-z]+ */, "", text)
        print ".TP\n.BR caustica\\-" $1 " (1)\n" escaped(text)
        next
    }
    /^  (-.,|   ) --[a-z]/ {
        section("OPTIONS")
        match($0, /--[a-z0-9-]+( [^ ]+)?/)
        rest = substr($0, RSTART + RLENGTH)
        sub(/^ +/, "", rest)
        head = substr($0, 1, RSTART + RLENGTH - 1)
        sub(/^ +/, "", head)
        print ".TP\n.B " escaped(head)
        if (rest != "") print escaped(rest)
        in_option = 1
        next
    }
    in_option && /^                    / {
        sub(/^ +/, "")
        print escaped($0)
        next
    }
    { in_option = 0 }
    /^ *$/ { as_is(0); if (filled) print ".PP"; filled = 0; next }
    {
        if (name != "caustica" || current != "") section(name == "caustica" ? "USAGE" : "DESCRIPTION")
        as_is($0 ~ /^  /)
        filled = 1
        print escaped($0)
    }
    END {
        as_is(0)
        count = split(commands, others, " ")
        print ".SH SEE ALSO"
        if (name != "caustica") printf ".BR caustica (1)"
        comma = name != "caustica"
        for (i = 1; i <= count; i++) {
            if ("caustica " others[i] == name) continue
            printf "%s.BR caustica\\-%s (1)", comma ? ",\n" : "", others[i]
            comma = 1
        }
        print ""
    }'
}

"$program" --help | to_man caustica >"$folder/caustica.1"
for command in $commands; do
    "$program" "$command" --help | to_man "caustica $command" >"$folder/caustica-$command.1"
done
