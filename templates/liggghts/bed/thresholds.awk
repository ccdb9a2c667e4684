# Says at which friction velocity of the undisturbed flow a part n of the N counted grains of a bed
# had moved, and writes how many had by the end of each load step:
#
#   awk -v table=load_steps.csv -f thresholds.awk grains.data load_steps.txt FS=, samples.csv
#
# A grain has moved when it no longer lies: it has passed the displacement criterion, or is gone.

FILENAME == "grains.data" {
    if (atoms && $2 == 3) count++
    if ($1 == "Atoms") atoms = 1
}
FILENAME == "load_steps.txt" { flow[FNR - 1] = $1 }
FILENAME == "samples.csv" && FNR > 1 { last = $1; moved[last] = count - $4 }

END {
    print "load_step,flow,moved,not_moved" >table
    for (step = 0; step <= last; step++)
        printf "%d,%s,%d,%d\n", step, flow[step], moved[step], count - moved[step] >table
    for (percent = 10; percent <= 70; percent += 20) {
        step = 1
        while (step <= last && moved[step] < percent / 100 * count - 1e-9) step++
        if (step > last) {
            printf "n/N = %d %%: not reached, %d of %d had moved\n", percent, moved[last], count
            continue
        }
        # they moved between the flow of the load step before and that of this one
        low = flow[step - 1]; high = flow[step]; at = sqrt(low * high)
        printf "n/N = %d %% at u*_0 %.4g m/s (%.4g ... %.4g)\n", percent, at, low, high
    }
    print "These are load steps in which grains left their pockets in the flow of the deck. Where a study asks for"
    print "sustained motion, its page has a flow of its own for each grain, between load steps, and other numbers."
}
