"""The challenge: many concealed cases, sealed, solved without the answers, scored against other methods."""
