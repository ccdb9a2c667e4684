"""How a scene is answered, and how well: fidelities, numerical errors, limits."""
