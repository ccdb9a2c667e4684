// The mesh over bed_line.geo. After a change: gmsh -3 pile.geo. SI units.
slope_deg = 15.0;        // of the windward faces; 0 if there are none, degrees
height = 0.02;           // of the forms; parameters holds ten of it as lidHeight, m
first_cell = 0.0006666;  // height of the cells on the bed, normal to the windward faces, m
growth = 1.21;           // ratio of neighbouring cells upwards; 1.1 for a study
