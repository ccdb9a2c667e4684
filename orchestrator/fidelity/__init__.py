"""How a scene is answered, and how well: fidelities, known errors, limits."""
