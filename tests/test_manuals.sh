#!/bin/bash
# Man pages and completion: each command and each option that the program knows stands in them, the pages are good for groff, and
# bash completes with them. Speaks TAP. CA_BUILD_DIR: the build folder.
set -u
build=${CA_BUILD_DIR:?the build folder}
program=$build/caustica
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT

number=0
check() { # check NAME COMMAND...
    local name=$1 output
    shift
    number=$((number + 1))
    if output=$("$@" 2>&1); then
        echo "ok $number - $name"
    else
        echo "not ok $number - $name"
        printf '%s\n' "$output" | sed 's/^/# /'
    fi
}

echo "1..9"
make_all() {
    sh scripts/help-to-man.sh "$program" "$folder/man" &&
        sh scripts/help-to-completion.sh "$program" "$folder/bash" "$folder/zsh"
}
check "are made" make_all

commands=$("$program" --help | sed -n 's/^  \([a-z][a-z]*\)  .*/\1/p')
# Lines of a help that begin with an option, whatever follows.
options_of() { "$program" "$1" --help | sed -n 's/^  \(-.,\|   \) --\([a-z0-9-]*\).*/\2/p'; }

help_is_good() {
    for command in $commands; do
        "$program" "$command" --help >"$folder/help" || return 1
        grep -Eq "^Examples?: caustica $command " "$folder/help" || { echo "$command: no example"; return 1; }
        [ "$(head -c $((10 + ${#command})) "$folder/help")" = "caustica $command " ] || { echo "$command: first line"; return 1; }
        [ "$(wc -l <"$folder/help")" -le 80 ] || { echo "$command: long"; return 1; }
        [ "$(options_of "$command" | wc -l)" -ge 2 ] || { echo "$command: no options"; return 1; }
    done
    [ "$(printf '%s\n' "$commands" | wc -l)" -ge 6 ]
}
check "each command has a help with an example" help_is_good

pages_are_complete() {
    for command in $commands; do
        page=$folder/man/caustica-$command.1
        grep -q "caustica\\\\-$command" "$folder/man/caustica.1" || { echo "$command is not in caustica(1)"; return 1; }
        for option in $(options_of "$command"); do
            escaped=$(printf "%s" "$option" | sed 's/-/\\\\-/g')
            grep -Eq "^\.B .*\\\\-\\\\-$escaped( |$)" "$page" || { echo "$command --$option is not in its page"; return 1; }
        done
        for section in NAME SYNOPSIS OPTIONS EXAMPLES "SEE ALSO"; do
            grep -q "^\.SH $section$" "$page" || { echo "$command has no $section"; return 1; }
        done
    done
    [ "$(find "$folder/man" -type f | wc -l)" -eq $(($(printf '%s\n' "$commands" | wc -l) + 1)) ]
}
check "a page for each command, with each option" pages_are_complete

if command -v groff >/dev/null; then
    pages_are_well_formed() {
        for page in "$folder"/man/*.1; do groff -man -Tascii -ww -z "$page"; done >"$folder/groff" 2>&1
        cat "$folder/groff"
        [ ! -s "$folder/groff" ]
    }
    check "groff has no complaint" pages_are_well_formed
else
    number=$((number + 1))
    echo "ok $number - groff has no complaint # SKIP groff is not installed"
fi

# complete WORD...: what bash offers for the last word.
complete_words() (
    . "$folder/bash"
    COMP_WORDS=(caustica "$@")
    COMP_CWORD=$#
    _caustica
    echo "${COMPREPLY[@]}"
)
completes() { # completes EXPECTED WORD...
    local expected=$1 found
    shift
    found=$(complete_words "$@")
    [ "$found" = "$expected" ] || { echo "$*: \"$found\" instead of \"$expected\""; return 1; }
}
bash_completes() {
    completes "render" re && completes "render" render && completes "--sampler" render --sam &&
        completes "--sampler" render a.xml --quiet --sam && completes "bdpt bdpm" render -i bd &&
        completes "bdpt bdpm" render --integrator bd && completes "halton halton-plain" render --sampler = ha &&
        completes "" render --spp 1 && completes "" info --s && completes "" nothing --s
}
check "bash completes commands, options and names" bash_completes

bash_knows_all() {
    local command found
    for command in $commands; do
        found=$(complete_words "$command" -- | tr ' ' '\n' | sort)
        [ "$found" = "$(options_of "$command" | sed 's/^/--/' | sort)" ] || { echo "$command: $found"; return 1; }
    done
    [ "$(complete_words "" | tr ' ' '\n' | grep -v '^-')" = "$commands" ]
}
check "bash knows all options of all commands" bash_knows_all

# All names there are, as the program lists them when it is given another one.
names_agree() {
    "$program" render a.xml -i nothing 2>&1 | sed -n 's/.*there are: \(.*\)).*/\1/p' | tr -d , >"$folder/names"
    completes "$(cat "$folder/names")" render -i "" || return 1
    "$program" render a.xml --sampler nothing 2>&1 | sed -n 's/.*there are //p' | tr -d , >"$folder/names"
    [ "$(cat "$folder/names")" ] && completes "$(cat "$folder/names")" render --sampler ""
}
check "bash knows integrators and samplers" names_agree

zsh_knows_all() {
    local command option
    for command in $commands; do
        sed -n "/^    $command)/,/;;/p" "$folder/zsh" >"$folder/part"
        for option in $(options_of "$command"); do
            grep -Eq -- "--$option=?['}]" "$folder/part" || { echo "$command --$option"; return 1; }
        done
    done
}
check "zsh knows all options of all commands" zsh_knows_all

if command -v zsh >/dev/null; then
    check "zsh reads it" zsh -n "$folder/zsh"
else
    number=$((number + 1))
    echo "ok $number - zsh reads it # SKIP zsh is not installed"
fi
