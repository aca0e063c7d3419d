"""A result as one page that opens in any browser."""

from .report import report

__all__ = ["report"]
