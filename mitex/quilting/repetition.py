"""How much the parts of an exemplar are repeated in a texture, as a penalty.

Left alone, the search for the least difference shows a few patches over and over and shuns whatever is rare
on the exemplar. Counting uses is the remedy of Kaspar et al. 2015 (Self Tuning Texture Optimization);
Huang et al. (2023) have none.
"""

from __future__ import annotations

import numpy as np

from mitex.errors import ConfigError

EVENNESS = 0.1
REACH = 0.3  # standard deviation of a use's spread over the exemplar [sides of a patch]


class Repetition:
    """Counts how often patches are used.

    Args:
        centres: (P, D) middles of the patches on the exemplar.
        length: side of a patch in the same units.
        evenness: one use of a patch weighs as much as this times the mean distance of all patches; 0 or more.

    Raises:
        ConfigError: `evenness` is negative or not finite.
    """

    def __init__(self, centres: np.ndarray, length: float, evenness: float) -> None:
        if not 0.0 <= evenness < np.inf:
            raise ConfigError(f"an evenness of {evenness}", "use 0 or more")
        self.centres, self.reach, self.evenness = centres, REACH * length, evenness
        self.counts = np.zeros(len(centres), np.float32)

    def add(self, index: int) -> None:
        """A patch was used: that counts for it, and for others the less the farther away they were taken."""
        away = np.linalg.norm(self.centres - self.centres[index], axis=1)
        self.counts += np.exp(-np.square(away / self.reach) / 2).astype(np.float32)

    def penalties(self) -> np.ndarray:
        """(P,) what patches cost more for having been used, in mean distances of all patches."""
        return self.evenness * self.counts
