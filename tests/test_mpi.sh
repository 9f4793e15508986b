#!/bin/bash
# The program under mpirun, as a user starts it: the bits of one process, one message for a failure, signals as mpirun
# passes them on, and a rank that is killed. What several ranks do is tested without MPI in test_ranks and
# test_rank_work. Speaks TAP. CA_BUILD_DIR: the build folder.
set -u
. tests/support/tap.sh
build=${CA_BUILD_DIR:?the build folder}
program=$(cd "$build" && pwd)/caustica

if ! ldd "$program" | grep -q libmpi; then
    echo "1..2"
    left_out "renders under mpirun" "this build has no MPI (packages libopenmpi-dev, openmpi-bin)"
    # It must not make the same picture four times.
    refuses() {
        ! OMPI_COMM_WORLD_SIZE=4 OMPI_COMM_WORLD_RANK=0 "$program" version 2>&1 | grep -qx "caustica [0-9.]*" &&
            OMPI_COMM_WORLD_SIZE=4 OMPI_COMM_WORLD_RANK=0 "$program" version 2>&1 | grep -q "built without MPI" &&
            OMPI_COMM_WORLD_SIZE=1 OMPI_COMM_WORLD_RANK=0 "$program" version | grep -q "^caustica"
    }
    check "several processes are refused" refuses
    exit 0
fi
if ! command -v mpirun >/dev/null; then
    echo "1..1"
    left_out "renders under mpirun" "there is no mpirun (package openmpi-bin)"
    exit 0
fi

# More ranks than processors, and root, are what a test machine has.
export OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder" || exit 1

cat >ball.xml <<'END'
<scene version="3.0.0">
  <integrator type="path"><integer name="max_depth" value="4"/></integrator>
  <sensor type="perspective"><float name="fov" value="20"/>
    <transform name="to_world"><lookat origin="0,0,9" target="0,0,0" up="0,1,0"/></transform>
    <film type="hdrfilm"><integer name="width" value="24"/><integer name="height" value="16"/></film>
  </sensor>
  <shape type="sphere"/>
  <emitter type="constant"/>
</scene>
END

ranks() { # ranks N WORD...: the program by N ranks
    local count=$1
    shift
    timeout 60 mpirun --oversubscribe -n "$count" "$program" "$@"
}

# Starts a render by three ranks that takes longer than the test needs; its mpirun is $job.
start_long() {
    rm -f s.*
    mpirun --oversubscribe -n 3 "$program" render ball.xml --time 30 -o s.pfm --threads 1 --stats s.json "$@" \
        >said 2>&1 &
    job=$!
}

# Waits 20 seconds at most.
wait_for() {
    local i
    for ((i = 0; i < 400; i++)); do
        [ -e "$1" ] && return 0
        sleep 0.05
    done
    echo "$1 does not come"
    return 1
}

wait_for_end() {
    wait "$job"
    status=$?
    cat said
}

number_of() { sed -n "s/.*\"$1\": *\([0-9]*\),*/\1/p" "$2"; } # number_of NAME FILE

# is_of_its_passes PICTURE STATS: the bits of a render by one process of as many passes.
is_of_its_passes() {
    passes=$(number_of iterations "$2")
    [ "$passes" -gt 1 ] && "$program" render ball.xml --passes "0:$passes" -o same.pfm --quiet && cmp "$1" same.pfm
}

checkpoint_is_whole() {
    "$program" merge s.part -o left.pfm --stats left.json --quiet && is_of_its_passes left.pfm left.json
}

echo "1..9"

same_bits() {
    "$program" render ball.xml --spp 20 -o one.pfm --quiet &&
        ranks 4 render ball.xml --spp 20 -o four.pfm --stats s.json --threads 1 && cmp one.pfm four.pfm &&
        [ "$(number_of ranks s.json)" = 4 ] && [ "$(number_of iterations s.json)" = 20 ]
}
check "four ranks make the bits of one process" same_bits

same_blocks() {
    "$program" render ball.xml -i qmcppm:radius=0.1 --spp 9 -o one.pfm --quiet &&
        ranks 2 render ball.xml -i qmcppm:radius=0.1 --spp 9 -o two.pfm --quiet && cmp one.pfm two.pfm
}
check "so do two of blocks" same_blocks

one_message() {
    echo "<scene version='3.0.0'><shape type='nonsense'/></scene>" >bad.xml
    ranks 4 render bad.xml -o x.pfm >said 2>&1
    [ $? = 1 ] && [ "$(grep -c 'unknown shape "nonsense"' said)" = 1 ] && [ "$(grep -c caustica: said)" = 1 ]
}
check "a bad scene is told once, exit status 1" one_message

# The first picture comes from SIGUSR1; the whole range of passes that is told by the last one.
signals() {
    start_long --checkpoint s.part --checkpoint-every 0.2
    wait_for s.part || return 1
    kill -USR1 "$job"
    wait_for s.pfm && wait_for s.json || return 1
    mv s.pfm first.pfm
    kill -USR2 "$job"
    wait_for_end
    [ "$status" = 0 ] && [ -e s.pfm ] && grep -q "ended early by a signal" said && [ ! -e s.part.lock ] &&
        is_of_its_passes s.pfm s.json
}
check "SIGUSR1 writes a picture, SIGUSR2 ends with one" signals

resumes() {
    passes=$(number_of iterations s.json)
    "$program" merge s.part -o merged.pfm --quiet && cmp s.pfm merged.pfm &&
        ranks 2 render ball.xml --spp $((passes + 50)) -o more.pfm --checkpoint s.part --resume --quiet &&
        "$program" render ball.xml --spp $((passes + 50)) -o same.pfm --quiet && cmp more.pfm same.pfm
}
check "its checkpoint is whole, and gone on from" resumes

# mpirun ends the others: what is left is the last checkpoint, of which one process makes the rest.
dead_rank() {
    start_long --checkpoint s.part --checkpoint-every 0.2
    wait_for s.part || return 1
    sleep 0.5
    pkill -KILL -n -P "$job" || return 1
    wait_for_end
    [ "$status" != 0 ] && [ ! -e s.pfm ] && checkpoint_is_whole
}
check "a rank that is killed leaves the last checkpoint" dead_rank

# A rank may be a moment behind mpirun.
all_gone() {
    local i
    for ((i = 0; i < 600; i++)); do
        pgrep -f "$program render ball.xml --time 30 -o s.pfm" >/dev/null || return 0
        sleep 0.05
    done
    echo "a rank is left"
    return 1
}

# As Ctrl-C (INT) and schedulers (TERM) do. mpirun passes SIGTERM on and a second later SIGKILL, which is enough for
# the picture here, but not on a machine with other work: what must be left is the checkpoint.
ended_from_outside() { # ended_from_outside SIGNAL
    start_long --checkpoint s.part --checkpoint-every 0.2
    wait_for s.part || return 1
    sleep 0.5
    kill "-$1" "$job"
    wait_for_end
    [ "$status" != 0 ] && all_gone || return 1
    checkpoint_is_whole && { [ ! -e s.json ] || is_of_its_passes s.pfm s.json; }
}
check "Ctrl-C leaves the last checkpoint" ended_from_outside INT
check "so does SIGTERM" ended_from_outside TERM

others_once() { [ "$(ranks 2 version | grep -c caustica)" = 1 ]; }
check "another command runs once" others_once
