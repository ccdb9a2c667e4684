# Read by Allrun: `solve DECK` runs a deck with as many processes as parameters.liggghts says;
# `came_to_its_end` says of log.liggghts whether the deck was done.

# a solver must not outlive the shell that started it
bound=
setpriv --pdeathsig KILL true 2>/dev/null && bound="setpriv --pdeathsig KILL"

# no search for fast networks, which takes 0.2 s
export OMPI_MCA_pml=ob1

solve() {
    ranks=$(sed -n 's/^variable *ranks equal \([0-9]*\).*/\1/p' parameters.liggghts)
    # unbuffered, or the message of an error is lost with the process
    run="$bound stdbuf -o0 liggghts -in $1 -nocite -log none"
    if [ "${ranks:-1}" -eq 1 ]; then
        # one process needs no MPI daemon: where the machine's own name resolves nowhere, it would
        # wait 5 s; nor a directory that it shares with others, one of which may remove it while
        # this one starts. Open MPI 5 makes that directory in any case: here, for this run alone
        export OMPI_MCA_ess_singleton_isolated=1 OMPI_MCA_orte_create_session_dirs=0
        TMPDIR=$PWD $run
        ended=$?
        rm -rf ompi.*
        return $ended
    fi
    # all on this machine, in a container too, as root too
    export OMPI_MCA_plm=isolated OMPI_MCA_btl_vader_single_copy_mechanism=none
    export OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1
    # a directory that no other run may remove, with a short path: there are sockets in it
    own=$(mktemp -d) || return
    TMPDIR=$own $bound mpirun --oversubscribe --bind-to none -np "$ranks" $run
    ended=$?
    rm -rf "$own"
    return $ended
}

# LIGGGHTS ends with 0 in any case: a deck prints its last words when it is done
came_to_its_end() {
    grep -q '^the protocol has ended' log.liggghts && return
    echo "Allrun: LIGGGHTS stopped before the end of the deck, see log.liggghts" >&2
    return 1
}
