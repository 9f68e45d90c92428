.DEFAULT_GOAL := help
PYTHON ?= python3
BIN := .venv/bin

.PHONY: help install run test slow check docs pictures format benchmark clean

help: ## Show this list
	@awk -F ':.*## ' '/^[a-z]+:.*## / {printf "  make %-10s %s\n", $$1, $$2}' $(MAKEFILE_LIST)

install: $(BIN)/.installed ## Make the environment .venv with all that tests need

$(BIN)/.installed: requirements.txt requirements-dask.txt requirements-docs.txt requirements-dev.txt
	$(PYTHON) -m venv .venv
	$(BIN)/pip install -r requirements-dev.txt
	@touch $@

run: install ## Start the dashboard; it sees changes of the source
	$(BIN)/streamlit run app.py --server.showEmailPrompt=false --server.fileWatcherType=auto

test: install ## Run the tests, all but the slow ones
	$(BIN)/python -m pytest

slow: install ## Run the slow tests
	$(BIN)/python -m pytest -m slow

check: install ## Look at style and types
	$(BIN)/ruff check
	$(BIN)/ruff format --check
	$(BIN)/pyright --pythonpath $(BIN)/python

docs: install ## Build the documentation in build/site; a warning is an error
	NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --strict

pictures: install ## Make the pictures of the how-to pages anew, in a browser
	$(BIN)/python -m tests.browser.pictures

format: install ## Put the source in order
	$(BIN)/ruff check --fix
	$(BIN)/ruff format

benchmark: install ## Print the table of times and memory
	$(BIN)/python -m benchmarks

clean: ## Remove caches of the checkout, not .venv
	find . -path ./.venv -prune -o -name __pycache__ -type d -print | xargs rm -rf
	rm -rf .pytest_cache .ruff_cache .hypothesis
