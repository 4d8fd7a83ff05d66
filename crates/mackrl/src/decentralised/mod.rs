//! Execution by one agent alone, and the certificate that it equals the central run.
