#!/bin/sh
# Completion for bash and zsh from what the program says of itself, so that it cannot go stale: commands from
# `caustica --help`, options from `caustica COMMAND --help`, samplers from that of render, integrators with their
# parameters from `caustica help --integrators`, other names from `caustica help --values`. All of it is in the
# scripts: the shell does not call the program.
#
#   scripts/help-to-completion.sh CAUSTICA BASH-FILE ZSH-FILE
#
# What an option's value is, its argument says: FILE is a file, FOLDER and DIR are folders. Values of --integrator,
# --sampler and some others are names, of --layers a list of them with commas; behind an integrator's, "path:", are
# its parameters and their values. Words that are no options are files.
set -eu
program=$1 bash_file=$2 zsh_file=$3

# One line for each: "command NAME SUMMARY", "option COMMAND LETTER LONG ARGUMENT HELP", "integrator NAME",
# "integrator NAME:PARAMETER=VALUE", "sampler NAME", "value OPTION NAME"; with tabs; "-" where there is none.
describe() {
    "$program" --help | awk '/^  [a-z]/ && $1 != "caustica" {
        name = $1
        sub(/^ *[a-z-]+ */, "")
        print "command\t" name "\t" $0
    }'
    "$program" help --integrators | awk '{ print "integrator\t" $0 }'
    "$program" help --values | awk '{ print "value\t" $1 "\t" $2 }'
    for command in $("$program" --help | awk '/^  [a-z]/ && $1 != "caustica" { print $1 }'); do
        "$program" "$command" --help | awk -v command="$command" '
        function flush() { if (head != "") print head "\t" (help == "" ? "-" : help); head = "" }
        /^  (-.,|   ) --[a-z]/ {
            flush()
            letter = $1 ~ /^-.,$/ ? substr($1, 2, 1) : "-"
            match($0, /--[a-z0-9-]+/)
            long = substr($0, RSTART + 2, RLENGTH - 2)
            rest = substr($0, RSTART + RLENGTH)
            argument = "-"
            if (match(rest, /^ [^ ]+/)) {
                argument = substr(rest, 2, RLENGTH - 1)
                rest = substr(rest, RLENGTH + 1)
            }
            sub(/^ +/, "", rest)
            head = "option\t" command "\t" letter "\t" long "\t" argument
            help = rest
            next
        }
        head != "" && /^                    / { sub(/^ +/, ""); help = help (help == "" ? "" : " ") $0; next }
        { flush() }
        /^Samplers: / && command == "render" { listed = 1; sub(/^Samplers: /, "") }
        listed { # a line that ends with a comma goes on
            count = split($0, names, /, */)
            for (i = 1; i <= count; i++) if (names[i] != "") print "sampler\t" names[i]
            listed = /,$/
        }
        END { flush() }'
    done
}

# What both scripts below begin with.
common='
function kind_of(long, argument)
{
    if (long == "integrator") return "integrators"
    if (long == "sampler") return "samplers"
    if (long in values) return (long in lists ? "list_" : "values_") long
    if (argument ~ /FILE/) return "files"
    if (argument ~ /^(DIR|FOLDER)$/) return "folders"
    return argument == "-" ? "flag" : "other"
}
BEGIN { FS = "\t" }
$1 == "command" { command[++commands] = $2; summary[$2] = $3 }
$1 == "option" { n = ++options[$2]; letter[$2, n] = $3; long[$2, n] = $4; argument[$2, n] = $5; help[$2, n] = $6 }
$1 == "integrator" { integrators = integrators (integrators == "" ? "" : " ") $2 }
$1 == "option" && $5 == "LIST" { lists[$4] }
$1 == "value" && !($2 in values) { named[++valued] = $2; values[$2] = $3; next }
$1 == "value" { values[$2] = values[$2] " " $3 }
$1 == "sampler" { samplers = samplers (samplers == "" ? "" : " ") $2 }
'

for_bash='
END {
    print "# Completion of caustica for bash; made by scripts/help-to-completion.sh."
    print "_caustica_integrators=\"" integrators "\"\n"
    print "# Replies for \"name\", \"name:parameter\" and \"name:parameter=value,parameter=value\": $1 is all"
    print "# that was typed, $2 the end of it that a reply replaces."
    print "_caustica_integrator()\n{"
    print "    local last=${1##*[:,]} head=${1%\"$2\"} front text candidate replies=()"
    print "    front=${1%\"$last\"}"
    print "    for candidate in $_caustica_integrators; do"
    print "        case $1 in"
    print "        *:*)"
    print "            case $candidate in \"${1%%:*}\":*) text=${candidate#*:} ;; *) continue ;; esac"
    print "            case $last in *=*) ;; *) text=${text%%=*}= ;; esac"
    print "            ;;"
    print "        *) case $candidate in *:*) continue ;; *) text=$candidate ;; esac ;;"
    print "        esac"
    print "        case $text in *=) [ \"$text\" = \"$last\" ] && continue ;; esac"
    print "        case $text in \"$last\"*) ;; *) continue ;; esac"
    print "        text=$front$text"
    print "        text=${text#\"$head\"}"
    print "        [ ${#replies[@]} -gt 0 ] && [ \"${replies[${#replies[@]}-1]}\" = \"$text\" ] && continue"
    print "        replies+=(\"$text\")"
    print "    done"
    print "    case ${replies[0]} in *=) compopt -o nospace 2>/dev/null ;; esac"
    print "    COMPREPLY=(\"${replies[@]}\")\n}\n"
    print "_caustica()\n{"
    print "    local word=${COMP_WORDS[COMP_CWORD]} i=$COMP_CWORD before options= kind="
    print "    local whole=$word"
    print "    case $word in : | = | :=) word= ;; esac"
    print "    # Bash splits words at \":\" and \"=\": they are joined again."
    print "    while [ \"$i\" -gt 1 ]; do"
    print "        case ${COMP_WORDS[i-1]}/${COMP_WORDS[i]} in *[:=]/* | */[:=]*) ;; *) break ;; esac"
    print "        i=$((i - 1))"
    print "        whole=${COMP_WORDS[i]}$whole"
    print "    done"
    print "    before=${COMP_WORDS[i-1]}"
    print "    case $whole in --*=*) before=${whole%%=*} whole=${whole#*=} ;; esac"
    names = command[1]
    for (i = 2; i <= commands; i++) names = names " " command[i]
    print "    if [ \"$COMP_CWORD\" -eq 1 ]; then"
    print "        COMPREPLY=($(compgen -W \"" names " help version --help --version\" -- \"$word\"))\n        return"
    print "    elif [ \"$COMP_CWORD\" -eq 2 ] && [ \"${COMP_WORDS[1]}\" = help ]; then"
    print "        COMPREPLY=($(compgen -W \"" names "\" -- \"$word\"))\n        return\n    fi"
    print "    case ${COMP_WORDS[1]} in"
    for (i = 1; i <= commands; i++) {
        c = command[i]
        printf "    %s) options=\"", c
        for (k = 1; k <= options[c]; k++) printf "%s--%s", (k > 1 ? " " : ""), long[c, k]
        print "\" ;;"
    }
    print "    esac\n    case \"${COMP_WORDS[1]} $before\" in"
    for (i = 1; i <= commands; i++) {
        c = command[i]
        for (k = 1; k <= options[c]; k++) {
            kind = kind_of(long[c, k], argument[c, k])
            if (kind == "flag") continue
            printf "    \"%s --%s\"", c, long[c, k]
            if (letter[c, k] != "-") printf " | \"%s -%s\"", c, letter[c, k]
            print ") kind=" kind " ;;"
        }
    }
    print "    esac\n    COMPREPLY=()\n    case $kind in"
    print "    integrators) _caustica_integrator \"$whole\" \"$word\" ;;"
    print "    samplers) COMPREPLY=($(compgen -W \"" samplers "\" -- \"$word\")) ;;"
    for (i = 1; i <= valued; i++) {
        names = "-W \"" values[named[i]] "\" --"
        if (!(named[i] in lists)) {
            print "    values_" named[i] ") COMPREPLY=($(compgen " names " \"$word\")) ;;"
            continue
        }
        print "    list_" named[i] ") # behind a comma the next name"
        print "        COMPREPLY=($(compgen -P \"${word%\"${word##*,}\"}\" " names " \"${word##*,}\")) ;;"
    }
    print "    files) compopt -o default 2>/dev/null ;;"
    print "    folders) compopt -o dirnames 2>/dev/null ;;"
    print "    other) ;;"
    print "    *)"
    print "        case $word in"
    print "        -*) COMPREPLY=($(compgen -W \"$options\" -- \"$word\")) ;;"
    print "        *) compopt -o default 2>/dev/null ;;"
    print "        esac"
    print "        ;;"
    print "    esac\n}\ncomplete -F _caustica caustica"
}'

for_zsh='
function quoted(text)
{
    gsub(/\\/, "\\\\", text)
    gsub(/:/, "\\:", text)
    gsub(/\[/, "\\[", text)
    gsub(/\]/, "\\]", text)
    gsub(/\047/, "\047\\\047\047", text)
    return text
}
function action(kind)
{
    if (kind == "integrators") return "_caustica_integrators"
    if (kind == "samplers") return "(" samplers ")"
    if (kind ~ /^values_/) return "(" values[substr(kind, 8)] ")"
    if (kind ~ /^list_/) return "{_values -s , name " values[substr(kind, 6)] "}"
    return kind == "files" ? "_files" : kind == "folders" ? "_files -/" : " "
}
END {
    print "#compdef caustica\n# Completion of caustica for zsh; made by scripts/help-to-completion.sh."
    print "_caustica_integrators() {"
    print "    local name=${PREFIX%%:*} last=${PREFIX##*[:,]} candidate"
    print "    local front=${PREFIX%$last}"
    print "    local -a candidates found\n    candidates=(" integrators ")"
    print "    if [[ $PREFIX != *:* ]]; then\n        compadd -- ${candidates:#*:*}\n        return\n    fi"
    print "    for candidate in ${(M)candidates:#$name:*}; do"
    print "        if [[ $last != *=* ]]; then\n            found+=($front${${candidate#*:}%%=*}=)"
    print "        elif [[ $candidate == *=?* ]]; then\n            found+=($front${candidate#*:})\n        fi"
    print "    done"
    print "    if [[ $last == *=* ]]; then\n        compadd -- $found"
    print "    else\n        compadd -S \"\" -- ${(u)found}\n    fi\n}\n"
    print "_caustica() {\n    local -a commands\n    local command=$words[2]\n    commands=("
    for (i = 1; i <= commands; i++) print "        \047" command[i] ":" quoted(summary[command[i]]) "\047"
    print "        \047help:the help of a command\047\n        \047version:the version of the program\047"
    print "    )\n    if (( CURRENT == 2 )); then\n        _describe command commands"
    print "        _arguments --help --version\n        return\n    fi"
    print "    shift words\n    (( CURRENT-- ))\n    case $command in"
    for (i = 1; i <= commands; i++) {
        c = command[i]
        print "    " c ")\n        _arguments \\"
        for (k = 1; k <= options[c]; k++) {
            kind = kind_of(long[c, k], argument[c, k])
            text = help[c, k]
            names = "--" long[c, k] (kind == "flag" ? "" : "=")
            if (letter[c, k] != "-") names = "{-" letter[c, k] (kind == "flag" ? "" : "+") "," names "}"
            else names = "\047" names "\047"
            value = kind == "flag" ? "" : ":" quoted(argument[c, k]) ":" action(kind)
            repeats = text ~ /several times/ ? "\047*\047" : ""
            print "            " repeats names "\047[" quoted(text) "]" value "\047 \\"
        }
        print "            \047*:file:_files\047\n        ;;"
    }
    print "    esac\n}\n_caustica \"$@\""
}'

mkdir -p "$(dirname "$bash_file")" "$(dirname "$zsh_file")"
describe | awk "$common$for_bash" >"$bash_file"
describe | awk "$common$for_zsh" >"$zsh_file"
