#!/bin/bash
# Man pages and completion: each command and each option that the program knows stands in them, the pages are good for
# groff, and bash completes with them. Speaks TAP. CA_BUILD_DIR: the build folder.
set -u
. tests/support/tap.sh
build=${CA_BUILD_DIR:?the build folder}
program=$build/caustica
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT

echo "1..15"
make_all() {
    sh scripts/help-to-man.sh "$program" "$folder/man" &&
        sh scripts/help-to-completion.sh "$program" "$folder/bash" "$folder/zsh"
}
check "are made" make_all

commands=$("$program" --help | sed -n 's/^  \([a-z][a-z]*\)  .*/\1/p')
# Lines of a help that begin with an option, whatever follows.
options_of() { "$program" "$1" --help | sed -n 's/^  \(-.,\|   \) --\([a-z0-9-]*\).*/\2/p'; }
# Those of them that take a value.
valued_options_of() { "$program" "$1" --help | sed -n 's/^  \(-.,\|   \) --\([a-z0-9-]*\) [^ ].*/\2/p'; }

help_is_good() {
    for command in $commands; do
        "$program" "$command" --help >"$folder/help" || return 1
        grep -Eq "^Examples?: caustica $command " "$folder/help" || { echo "$command: no example"; return 1; }
        [ "$(head -c $((10 + ${#command})) "$folder/help")" = "caustica $command " ] ||
            { echo "$command: first line"; return 1; }
        [ "$(wc -l <"$folder/help")" -le 110 ] || { echo "$command: long"; return 1; }
        [ "$(options_of "$command" | wc -l)" -ge 2 ] || { echo "$command: no options"; return 1; }
    done
    [ "$(printf '%s\n' "$commands" | wc -l)" -ge 6 ]
}
check "each command has a help with an example" help_is_good

# No line of a help is wider than 100 columns, and what an option's help goes on with below stands under its
# beginning.
lines_are_short() {
    for command in $commands; do
        "$program" "$command" --help >"$folder/help" || return 1
        awk -v command="$command" '
            /^  (-.,|   ) --[a-z]/ { options = 1 }
            length($0) > 100 { print command ": " $0; bad = 1 }
            /^$/ { options = 0 }
            options && !/^  (-.,|   ) --[a-z]/ && !/^                              [^ ]/ {
                print command ": not under its option: " $0
                bad = 1
            }
            END { exit bad }' "$folder/help" || return 1
    done
}
check "lines of helps are short" lines_are_short

pages_are_complete() {
    for command in $commands; do
        page=$folder/man/caustica-$command.1
        grep -q "caustica\\\\-$command" "$folder/man/caustica.1" ||
            { echo "$command is not in caustica(1)"; return 1; }
        for option in $(options_of "$command"); do
            escaped=$(printf "%s" "$option" | sed 's/-/\\\\-/g')
            grep -Eq "^\.B .*\\\\-\\\\-$escaped( |$)" "$page" ||
                { echo "$command --$option is not in its page"; return 1; }
        done
        for section in NAME SYNOPSIS OPTIONS EXAMPLES "SEE ALSO"; do
            grep -q "^\.SH $section$" "$page" || { echo "$command has no $section"; return 1; }
        done
    done
    [ "$(find "$folder/man" -type f | wc -l)" -eq $(($(printf '%s\n' "$commands" | wc -l) + 1)) ]
}
check "a page for each command, with each option" pages_are_complete

# Each line of a help, without the words that say where in the page it belongs.
pages_say_all() {
    for command in $commands; do
        sed -e '/^\.SH/d' -e 's/^\.[A-Z]* *//' -e 's/\\-/-/g' -e "s/\\\\(aq/'/g" -e 's/\\&//g' -e 's/\\e/\\/g' \
            -e 's/^caustica[a-z-]* - //' -e 's/^ *//' \
            "$folder/man/caustica-$command.1" >"$folder/page"
        "$program" "$command" --help | sed -e '1s/^[^:]*:\( \|$\)//' \
            -e 's/^  \(-.,\|   \) --[a-z0-9-]*\( [^ ][^ ]*\)\{0,1\}//' -e 's/^Examples\{0,1\}: //' \
            -e 's/^ *//' -e '/^$/d' >"$folder/help"
        [ "$(wc -l <"$folder/help")" -ge 3 ] || { echo "$command: hardly a help"; return 1; }
        if grep -Fxv -f "$folder/page" "$folder/help"; then
            echo "$command: not in its page"
            return 1
        fi
    done
}
check "pages say all that helps say" pages_say_all

if command -v groff >/dev/null; then
    pages_are_well_formed() {
        for page in "$folder"/man/*.1; do groff -man -Tascii -ww -z "$page"; done >"$folder/groff" 2>&1
        cat "$folder/groff"
        [ ! -s "$folder/groff" ]
    }
    check "groff has no complaint" pages_are_well_formed
else
    left_out "groff has no complaint" "groff is not installed"
fi

# complete WORD...: what bash offers for the last word.
complete_words() (
    compopt() { COMPREPLY=("$*"); } # bash's own, which looks for files, works only while it completes
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
    completes "render" re && completes "help" he && completes "version" ve && completes "render" render &&
        completes "--sampler" render --sam &&
        completes "--sampler" render a.xml --quiet --sam && completes "bdpt bdpm" render -i bd &&
        completes "bdpt bdpm" render --integrator bd && completes "halton halton-plain" render --sampler = ha &&
        completes "" render --spp 1 && completes "--sensor" info --s && completes "" converge --zz &&
        completes "" nothing --s &&
        completes "-o default" render sc && completes "-o default" render --stats "" &&
        completes "-o default" render -o "" &&
        completes "-o dirnames" render --dump-strategies ""
}
check "bash completes commands, options and names" bash_completes

# Bash hands over "path:rr=" as "path", ":", "rr" and "=", and replaces the last of these words; the last word is "="
# or ":" itself where nothing follows yet.
bash_completes_parameters() {
    completes "max_depth= rr_depth= hide_emitters= heuristic= next_event=" render -i path : &&
        completes "max_depth= rr_depth= hide_emitters= heuristic= next_event=" render --integrator = path : &&
        completes "rr_depth=" render -i path : rr && completes "" render -i path : radius &&
        completes "radius= radius_pixels=" render a.xml -i vcm : radius &&
        completes "radius= radius_pixels= radius_photons=" render -i qmcppm : rad &&
        completes "balance power" render -i path : heuristic = && completes "power" render -i path : heuristic = po &&
        completes "balance power" render --integrator = vcm : heuristic = &&
        completes "true false" converge -i path : hide_emitters = &&
        completes "3,heuristic=" render -i path : rr_depth = 3,heu &&
        completes "balance power" render -i path : rr_depth = 3,heuristic = &&
        completes "" render -i path : max_depth = && completes "" render -i nothing : m &&
        completes "plain projected" noise -i ovcm : footprint =
}
check "bash completes parameters of integrators and their values" bash_completes_parameters

# Where ":" and "=" do not split words, replies are whole.
bash_completes_whole_words() {
    completes "path:heuristic=balance path:heuristic=power" render -i path:heuristic= &&
        completes "vcm:alpha=1,radius= vcm:alpha=1,radius_pixels=" render -i vcm:alpha=1,rad &&
        completes "noise" help noi
}
check "bash completes words that are not split" bash_completes_whole_words

# Names that options take; of layers a list, whose next name is completed.
bash_completes_values() {
    completes "srgb aces hable reinhard linear" render --tone "" && completes "aces" merge --tone a &&
        completes "aces" compare --tone = a && completes "srgb aces hable reinhard" compare --flip-tone "" &&
        completes "ldr hdr both none" compare --flip "" && completes "worst-decile" render --objective w &&
        completes "mean" noise --objective m && completes "all" render --layers al &&
        completes "Albedo,Noise Albedo,Noise.Camera Albedo,Noise.Light Albedo,Noise.Pair" merge --layers Albedo,No &&
        completes "Albedo,N.X,P.Z" render --layers Albedo,N.X,P.Z && completes "" render --threads ""
}
check "bash completes values that are names" bash_completes_values

# What is offered is what the program takes: it complains of the next thing.
values_are_taken() {
    local option value
    "$program" help --values >"$folder/values"
    [ "$(wc -l <"$folder/values")" -gt 60 ] || return 1
    while read -r option value; do
        case $option in
        tone | layers) set -- merge none.part -o a.png -o a.exr ;;
        flip | flip-tone) set -- compare none.pfm --reference none.pfm ;;
        objective) set -- render none.xml --rays auto -i bdpm --spp 2 -o a.exr ;;
        *) echo "$option is not tested"; return 1 ;;
        esac
        (cd "$folder" && "$program" "$@" "--$option" "$value") >"$folder/said" 2>&1
        grep -q "none.*cannot open" "$folder/said" || { echo "--$option $value"; cat "$folder/said"; return 1; }
    done <"$folder/values"
}
check "values that are completed are taken" values_are_taken

bash_knows_all() {
    local command found
    for command in $commands; do
        found=$(complete_words "$command" -- | tr ' ' '\n' | sort)
        [ "$found" = "$(options_of "$command" | sed 's/^/--/' | sort)" ] || { echo "$command: $found"; return 1; }
    done
    [ "$(complete_words "" | tr ' ' '\n' | grep -v '^-')" = "$(printf '%s\n' $commands help version)" ]
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

# What stands in brackets and between colons for _arguments has none of its own.
zsh_names="(\{-.\+?,--[a-z0-9-]+=?\}|'--[a-z0-9-]+=?')"
zsh_spec="^ +('\*')?$zsh_names'\[([^]:\\[]|\\\\.)*\](:([^]:\\[]|\\\\.)*:[^:]*)?' \\\\$"
zsh_knows_all() {
    local command option valued
    for command in $commands; do
        sed -n "/^    $command)/,/;;/p" "$folder/zsh" >"$folder/part"
        valued=" $(valued_options_of "$command" | tr '\n' ' ')"
        for option in $(options_of "$command"); do
            [[ $valued == *" $option "* ]] && option=$option=
            grep -Eq -- "--$option['}]" "$folder/part" || { echo "$command --$option"; return 1; }
        done
        if grep -e ' .*--[a-z]' "$folder/part" | grep -Ev "$zsh_spec"; then return 1; fi
    done
}
check "zsh knows all options of all commands" zsh_knows_all

if command -v zsh >/dev/null; then
    check "zsh reads it" zsh -n "$folder/zsh"
else
    left_out "zsh reads it" "zsh is not installed"
fi
