"""Inference: candidate columns, marginal likelihoods, model selection, and the exact fit."""
