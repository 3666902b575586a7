"""What the asset generators share: pictures, drawing, noise, glyphs, meshes. Standard library only."""
