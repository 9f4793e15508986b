# For tests in shell, which speak TAP: sourced by them. They print the plan.
number=0

# check NAME COMMAND...: passes if the command does; else what it printed is shown.
check() {
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

# left_out NAME WHY: stands for a check that this machine cannot make.
left_out() {
    number=$((number + 1))
    echo "ok $number - $1 # SKIP $2"
}
