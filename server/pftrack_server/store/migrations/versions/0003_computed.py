"""The furthest frame computed of a saved run has the name that it has everywhere."""

from alembic import op

revision = "0003"
down_revision = "0002"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Rename the column."""
    with op.batch_alter_table("runs") as runs:
        runs.alter_column("head", new_column_name="computed")


def downgrade() -> None:
    """Give the column its earlier name."""
    with op.batch_alter_table("runs") as runs:
        runs.alter_column("computed", new_column_name="head")
