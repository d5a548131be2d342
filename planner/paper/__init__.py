"""Evidence for the article: its experiments, figures and claims."""
