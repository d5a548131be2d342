"""The experiments of the paper, in the order of its sections."""

EXPERIMENTS = (
    "figure1/section3",
    "grid5x5/guarantee",
    "figure3/section4",
    "grid5x5/figure8",
    "grid5x5/figure9",
    "grid5x5/optimum",
    "grid5x5/readings",
    "grid5x5/particles",
    "grid5x5/beliefs",
    "grid5x5/online",
)
