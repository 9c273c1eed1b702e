//! Fresnel reflectance.
