"""What fits of a system to data share: checked data, ranges and priors, starts, noise, and the model beside the data.

Shared by the rooms calibration and diagnosis; nothing of it is public.
"""
