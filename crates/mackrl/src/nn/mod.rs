//! The numerical core: small layers with explicit backward passes.
