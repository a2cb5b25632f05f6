"""Laws for what no listed effect explains: from the error of the best model to a formula."""
