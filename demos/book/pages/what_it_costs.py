# ---
# jupyter:
#   jupytext:
#     formats: py:percent
# ---

# %% [markdown]
# # What each option costs
#
# Measured on this page when the book was built, on one core: the half cylinder of {doc}`section_3_1_1_normal_loading`,
# without friction, to a natural residual of $10^{-8}$.

# %% tags=["hide-input"]
print(1)
