"""What muscles and limbs look like, as vertices and triangles; knows nothing that draws them."""
