"""Lectures, and polls with what was answered."""

import sqlalchemy as sa
from alembic import op

revision = "0005"
down_revision = "0004"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Create both tables."""
    op.create_table(
        "lectures",
        sa.Column("id", sa.String(32), primary_key=True),
        sa.Column("title", sa.String(200), nullable=False),
        sa.Column("text", sa.Text, nullable=False),
        sa.Column("created", sa.String(32), nullable=False),
        sa.Column("updated", sa.String(32), nullable=False),
    )
    op.create_index("ix_lectures_created", "lectures", ["created"])
    op.create_table(
        "polls",
        sa.Column("id", sa.String(32), primary_key=True),
        sa.Column("lecture", sa.String(32), nullable=True),
        sa.Column("title", sa.String(200), nullable=False),
        sa.Column("question", sa.Text, nullable=False),
        sa.Column("answers", sa.JSON, nullable=False),
        sa.Column("counts", sa.JSON, nullable=False),
        sa.Column("followers", sa.Integer, nullable=False),
        sa.Column("asked", sa.String(32), nullable=False),
    )
    op.create_index("ix_polls_lecture", "polls", ["lecture"])
    op.create_index("ix_polls_asked", "polls", ["asked"])


def downgrade() -> None:
    """Drop both tables."""
    op.drop_table("polls")
    op.drop_table("lectures")
