"""The platform as a CAD mesh: its nominal inertia, and whether the mesh can be believed."""
