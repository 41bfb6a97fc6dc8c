"""The trial's own report: text, page, Markdown and figures of a score; draws, computes none."""
