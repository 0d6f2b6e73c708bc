"""Weather one can see: sky and air, wet road, snow cover and falling particles, as separate layers."""
