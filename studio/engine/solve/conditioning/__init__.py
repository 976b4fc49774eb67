"""Conditioning: limits and filters on the joints before the solve (step 6) or on the pose after it (step 9).

`bone_length` and `displacement` are the thesis's limits (5.5). `filters` has its Holt smoothing and the One-Euro
filter.
"""
