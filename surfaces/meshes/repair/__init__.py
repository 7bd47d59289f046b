"""Any triangles into a clean oriented 2-manifold, every repair reported."""
