# %% [markdown]
# # Your first map
#
# A self-organising map lays a sheet over your data. Each unit of the sheet is a point among the data, its *code*, and
# units that are neighbours on the sheet have codes that are alike. So the sheet is a picture of data that have too
# many columns to be drawn. Here the data are 150 iris flowers with four measures each.

# %%
import matplotlib.pyplot as plt
import numpy as np
from sklearn.datasets import load_iris
from sklearn.preprocessing import MinMaxScaler

from somatopy import SOM, load_map
from somatopy.maps import pictures
from somatopy.maps.quality import quantisation_error, topographic_error

iris = load_iris()
flowers = MinMaxScaler().fit_transform(iris.data)  # each measure from 0 to 1, so that none outweighs another
print(flowers.shape, "from", flowers.min(), "to", flowers.max())

# %% [markdown]
# ## Learn
#
# For a table that lies before you, `SOM(shape=(10, 10), random_state=0).fit(flowers)` is all: it shuffles, and passes
# over the rows often enough. Here the rows come as a stream, to show what goes on. `partial_fit` takes them in their
# order, and goes on from what the map has learned before. The flowers are sorted by species, so they are
# shuffled in each round. `horizon` is the number of inputs after which the map has settled.

# %%
rounds, rng = 100, np.random.default_rng(0)
som = SOM(shape=(10, 10), horizon=rounds * len(flowers), random_state=0)
for _ in range(rounds):
    som.partial_fit(rng.permutation(flowers))

# %% [markdown]
# ## Is it any good?
#
# Two numbers say so. The *quantisation error* is how far a flower is from the nearest code, in the mean. To compare,
# take a map of one unit, the centre of all flowers. The *topographic error* is the share of flowers whose two nearest
# codes are not neighbours on the sheet: 0 means that the sheet has no folds.

# %%
centre = np.linalg.norm(flowers - flowers.mean(axis=0), axis=1).mean()
print(f"quantisation error {quantisation_error(som, flowers):.3f}; of one unit {centre:.3f}")
print(f"topographic error  {topographic_error(som, flowers):.3f}")

# %% [markdown]
# Do not be too impressed: 100 units share 150 flowers, and the map has seen them all.
# [Quality](../maps/quality.md) says how to measure on data that the map has not learned.
#
# ## Look
#
# `predict` says which unit wins for each flower, and `winner` for a single one, with its distance. No species was
# told to the map. Do flowers of one species win units of their own?

# %%
units = som.predict(flowers)
for name, species in zip(iris.target_names, range(3), strict=True):
    own = set(units[iris.target == species]) - set(units[iris.target != species])
    alone = np.isin(units[iris.target == species], list(own)).mean()
    print(f"{name:>10}: {alone:.0%} of its flowers win a unit that no other species wins")

# %% [markdown]
# A U-matrix shows how far each unit's code is from those of its neighbours. The bright band that runs across separates
# two groups of units, that is, two groups of flowers that differ.

# %%
axes = pictures.u_matrix(som)
axes.figure.savefig("first_map.png", dpi=80, bbox_inches="tight")
plt.close(axes.figure)

# %% [markdown]
# ![Distances between neighbouring units of the map of irises](first_map.png)
#
# ## Keep it
#
# `save` writes the map to a file, as arrays and JSON. Once loaded, it goes on learning bit for bit as it would have.

# %%
som.save("iris.npz")
print(np.array_equal(load_map("iris.npz").codebook_, som.codebook_))

# %% [markdown]
# Next: [which map for which data](../maps/README.md#which-one), [how good is a map](../maps/quality.md), and all the
# [pictures](../maps/pictures.md).
