// The shape of the pile and its mesh. After a change: gmsh -3 pile.geo. SI units.
slope_deg = 15.0;        // of both faces of the pile; 0 leaves a flat bed, degrees
height = 0.02;           // of the pile; parameters holds ten of it as lidHeight, m
first_cell = 0.0006666;  // height of the cells on the bed, normal to the faces of the pile, m
cells_per_face = 20;     // along each face of the pile; 40 for a study
growth_at_40 = 1.1;      // ratio of neighbouring cells up and beside the pile, with 40 on a face
