"""The verifier of cut trees: is it proved that no single motion covers every cell?"""
