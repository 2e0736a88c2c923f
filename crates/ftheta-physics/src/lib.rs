//! Pure mathematics of a galvo machine: motors, servo, optics, laser, and the audit of a plan.
