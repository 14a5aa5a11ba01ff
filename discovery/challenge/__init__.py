"""The challenge: many concealed cases, sealed, solved without the answers, scored, beside other methods."""
