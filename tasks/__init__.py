"""The science: surface, vehicle, scene, rendering, judging, and closing the loop."""

from tasks.kernel_cache import place_kernel_cache

place_kernel_cache()
